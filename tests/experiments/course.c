/* The boat of [Carensac2023] sec. 5.7 in its window of 5 m under 5000 N, driven by the input files that come
 * with the program: straight ahead, a slalom, stop and go. Coarse particles by default; the paper's size is
 * --radius 0.025. */
#include "experiment.h"

#include "app/carensac.h"
#include "app/pilot.h"
#include "app/reproduce.h"

static const char *const scene_file = SKIFF_SOURCE_DIR "/assets/scenes/boat-cylinder-5m.json";
static const double radius_default = 0.1;
static const double cruise_from = 10.0, cruise_to = 40.0; /* s; thrust begins at 5 s */

typedef struct Course {
    Scene *scene;
    SkiffSim *sim;
    Pilot pilot;
    FileWriter series;
    SkiffDrive drive; /* after the last step */
    double bow_up;    /* degrees */
    double count;
    double iterations; /* mean over all steps so far */
} Course;

static Course begin(const Experiment *experiment, const char *input) {
    Course course = {0};
    Err err = {0};
    char texts[2][64], path[4096];
    const char *edits[2] = {texts[0], texts[1]};
    snprintf(texts[0], sizeof texts[0], "particleRadius=%.9g", experiment->radius);
    snprintf(texts[1], sizeof texts[1], "timeStepSize=%.9g", carensac_time_step(experiment->radius));
    snprintf(path, sizeof path, SKIFF_SOURCE_DIR "/assets/inputs/%s.input", input);
    course.scene = scene_load(scene_file, edits, 2, &err);
    experiment_need(course.scene && pilot_read(&course.pilot, course.scene, path, NULL, &err), &err);
    course.sim = scene_start(course.scene, experiment->threads, SKIFF_SIMD_AUTO, &err);
    experiment_need(course.sim != NULL, &err);
    course.series =
        experiment_series(experiment, input, "t,x,z,heading,speed,bow_up,particles,iterations,ms");
    return course;
}

static double degrees(double angle) {
    return angle * 180.0 / pi;
}

static void advance(Course *course) {
    Err err = {0};
    experiment_need(pilot_step(&course->pilot, course->sim, &err), &err);
    experiment_step(course->sim);
    const SkiffStats *stats = skiff_stats(course->sim);
    const SkiffBody boat = skiff_body(course->sim, 0);
    const double iterations = stats->density_iterations + stats->divergence_iterations;
    course->drive = skiff_drive(course->sim, 0);
    course->bow_up = reproduce_bow_up(&boat);
    course->count = stats->particles;
    course->iterations += (iterations - course->iterations) / (double)stats->step;
    if (stats->step % 10 == 0)
        fprintf(course->series.stream, "%.6g,%.6g,%.6g,%.5g,%.5g,%.4g,%u,%g,%.4g\n", stats->time,
                boat.position[0], boat.position[2], degrees(course->drive.heading), course->drive.speed,
                course->bow_up, stats->particles, iterations, stats->step_ms);
}

static void end(Course *course) {
    experiment_close(&course->series);
    pilot_free(&course->pilot);
    skiff_destroy(course->sim);
    scene_free(course->scene);
}

static void sail_straight(Experiment *experiment) {
    Course course = begin(experiment, "straight");
    double speed[2] = {0}, bow = 0.0, heading = 0.0, least = INFINITY, most = 0.0, count = 0.0, steps = 0.0;
    double halves[2] = {0};
    while (skiff_time(course.sim) < cruise_to) {
        advance(&course);
        if (skiff_time(course.sim) < cruise_from)
            continue;
        const int half = skiff_time(course.sim) > 0.5 * (cruise_from + cruise_to);
        speed[half] += course.drive.speed;
        halves[half]++;
        bow += course.bow_up;
        heading = fmax(heading, fabs(degrees(course.drive.heading)));
        least = fmin(least, course.count);
        most = fmax(most, course.count);
        count += course.count;
        steps++;
    }
    count /= steps;
    const double mean = (speed[0] + speed[1]) / steps, first = speed[0] / halves[0],
                 second = speed[1] / halves[1];
    experiment_note(experiment, "straight: particles", count, "");
    experiment_note(experiment, "straight: iterations a step", course.iterations, "");
    experiment_within(experiment, "straight: speed", mean, 2.4, 3.4, "m/s");
    experiment_check(experiment, "straight: second half of the cruise against the first", second / first, 1.0,
                     0.05, "");
    experiment_within(experiment, "straight: bow up", bow / steps, 0.5, 15.0, "deg");
    experiment_limit(experiment, "straight: particles, farthest from the mean",
                     100.0 * fmax(most / count - 1.0, 1.0 - least / count), 2.0, "%");
    experiment_limit(experiment, "straight: off the heading", heading, 3.0, "deg");
    end(&course);
}

static void sail_slalom(Experiment *experiment) {
    Course course = begin(experiment, "slalom");
    double port = 0.0, starboard = 0.0;
    while (skiff_time(course.sim) < 46.0) {
        advance(&course);
        port = fmin(port, degrees(course.drive.heading));
        starboard = fmax(starboard, degrees(course.drive.heading));
    }
    experiment_within(experiment, "slalom: farthest to starboard", starboard, 28.0, 50.0, "deg");
    experiment_within(experiment, "slalom: farthest to port", port, -50.0, -28.0, "deg");
    experiment_check(experiment, "slalom: heading at the end", degrees(course.drive.heading), 0.0, 5.0,
                     "deg");
    experiment_within(experiment, "slalom: speed at the end", course.drive.speed, 2.0, 3.6, "m/s");
    end(&course);
}

static void stop_and_go(Experiment *experiment) {
    Course course = begin(experiment, "stop-and-go");
    double fastest = 0.0, stopped = INFINITY, again = 0.0;
    while (skiff_time(course.sim) < 27.0) {
        advance(&course);
        const double t = skiff_time(course.sim), speed = course.drive.speed;
        if (t < 11.0)
            fastest = fmax(fastest, speed);
        else if (t < 19.0)
            stopped = fmin(stopped, speed);
        else
            again = fmax(again, speed);
    }
    experiment_within(experiment, "stop and go: fastest before the stop", fastest, 2.0, 4.0, "m/s");
    /* two seconds full astern stop it and more */
    experiment_limit(experiment, "stop and go: slowest, astern until 15 s", stopped, 0.3, "m/s");
    experiment_within(experiment, "stop and go: fastest after it", again, 1.5, 4.0, "m/s");
    end(&course);
}

int main(int argc, char **argv) {
    Experiment experiment = experiment_begin_sized("course", radius_default, argc, argv);
    sail_straight(&experiment);
    sail_slalom(&experiment);
    stop_and_go(&experiment);
    return experiment_end(&experiment);
}

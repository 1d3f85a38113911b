/* ffmpeg as a child process, started without a shell.
 *
 * Frames go through a socket and not a pipe, since a socket can be written with MSG_NOSIGNAL: an ffmpeg that
 * dies becomes an error message, whatever the program does with SIGPIPE. The child runs with the signals of
 * the terminal blocked: after Ctrl-C it must live on until it has been sent the last frame and has written
 * the index of the file. Its messages go to a nameless file and are quoted when it fails. */
#include "video.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

enum { PATH_SIZE = 4096, SOCKET_BUFFER = 4 << 20 };

struct GfxVideo {
    char path[PATH_SIZE], temporary[PATH_SIZE + 8];
    size_t frame_size; /* bytes */
    long frames;
    pid_t child; /* 0: has been waited for */
    int status;  /* of the child, once waited for */
    int frames_fd, messages_fd;
};

static bool is_program(const char *path) {
    return access(path, X_OK) == 0;
}

bool gfx_video_check(Err *err) {
    const char *list = getenv("PATH");
    char path[PATH_SIZE];
    for (const char *folder = list ? list : "/usr/bin:/bin"; *folder;) {
        int length = (int)strcspn(folder, ":");
        snprintf(path, sizeof path, "%.*s/ffmpeg", length, folder);
        if (length > 0 && is_program(path))
            return true;
        folder += length;
        folder += *folder == ':';
    }
    return err_set(err, ERR_IO,
                   "--video: ffmpeg is not installed (Debian package ffmpeg: apt-get install ffmpeg); "
                   "without --video the frames are written as PNG files");
}

/* Puts the last line that ffmpeg wrote into the message. */
static bool report(const GfxVideo *video, const char *what, Err *err) {
    char text[512];
    off_t end = lseek(video->messages_fd, 0, SEEK_END);
    off_t begin = end > (off_t)sizeof text - 1 ? end - ((off_t)sizeof text - 1) : 0;
    ssize_t count = end > 0 ? pread(video->messages_fd, text, sizeof text - 1, begin) : 0;
    text[count > 0 ? count : 0] = '\0';
    for (size_t n = strlen(text); n > 0 && (text[n - 1] == '\n' || text[n - 1] == ' '); n--)
        text[n - 1] = '\0';
    const char *newline = strrchr(text, '\n');
    const char *line = newline ? newline + 1 : text;
    return err_set(err, ERR_IO, "%s: ffmpeg %s%s%s", video->path, what, *line ? ": " : "", line);
}

static void wait_for_child(GfxVideo *video) {
    while (video->child > 0 && waitpid(video->child, &video->status, 0) < 0 && errno == EINTR)
        continue;
    video->child = 0;
}

static void close_all(GfxVideo *video) {
    if (video->frames_fd >= 0)
        close(video->frames_fd);
    video->frames_fd = -1;
}

static void release(GfxVideo *video) {
    close_all(video);
    if (video->messages_fd >= 0)
        close(video->messages_fd);
    free(video);
}

static void block_terminal_signals(posix_spawnattr_t *attributes) {
    sigset_t set;
    pthread_sigmask(SIG_SETMASK, NULL, &set);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGTERM);
    sigaddset(&set, SIGHUP);
    posix_spawnattr_setsigmask(attributes, &set);
    posix_spawnattr_setflags(attributes, POSIX_SPAWN_SETSIGMASK);
}

/* Returns 0 or an errno. */
static int spawn(GfxVideo *video, int input, int width, int height, int fps) {
    char size[32], rate[16], output[PATH_SIZE + 16];
    snprintf(size, sizeof size, "%dx%d", width, height);
    snprintf(rate, sizeof rate, "%d", fps);
    snprintf(output, sizeof output, "file:%s", video->temporary); /* a name is not a protocol */
    /* Players take untagged films of this size for BT.709; ffmpeg would convert with BT.601. */
    const char *const words[] = {"ffmpeg",
                                 "-nostdin",
                                 "-hide_banner",
                                 "-loglevel",
                                 "error",
                                 "-y",
                                 "-f",
                                 "rawvideo",
                                 "-pixel_format",
                                 "rgb24",
                                 "-video_size",
                                 size,
                                 "-framerate",
                                 rate,
                                 "-i",
                                 "pipe:0",
                                 "-an",
                                 "-vf",
                                 "scale=out_color_matrix=bt709:out_range=tv",
                                 "-c:v",
                                 "libx264",
                                 "-preset",
                                 "veryfast",
                                 "-crf",
                                 "20",
                                 "-pix_fmt",
                                 "yuv420p",
                                 "-colorspace",
                                 "bt709",
                                 "-color_primaries",
                                 "bt709",
                                 "-color_trc",
                                 "bt709",
                                 "-color_range",
                                 "tv",
                                 "-movflags",
                                 "+faststart",
                                 "-f",
                                 "mp4",
                                 output,
                                 NULL};
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, video->messages_fd, STDERR_FILENO);
    posix_spawnattr_init(&attributes);
    block_terminal_signals(&attributes);
    extern char **environ;
    int fault = posix_spawnp(&video->child, "ffmpeg", &actions, &attributes, (char *const *)(uintptr_t)words,
                             environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    if (fault)
        video->child = 0;
    return fault;
}

GfxVideo *gfx_video_begin(const char *path, int width, int height, int fps, Err *err) {
    if (width % 2 != 0 || height % 2 != 0) {
        err_set(err, ERR_USAGE, "--video: width and height must be even, found %dx%d", width, height);
        return NULL;
    }
    if (strlen(path) >= PATH_SIZE) {
        err_set(err, ERR_IO, "%.64s...: cannot write: %s", path, strerror(ENAMETOOLONG));
        return NULL;
    }
    if (!gfx_video_check(err))
        return NULL;
    int pair[2], size = SOCKET_BUFFER;
    GfxVideo *video = calloc(1, sizeof *video);
    if (!video || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0) {
        err_set(err, ERR_IO, "%s: cannot start ffmpeg: %s", path, strerror(errno));
        free(video);
        return NULL;
    }
    snprintf(video->path, sizeof video->path, "%s", path);
    snprintf(video->temporary, sizeof video->temporary, "%s.tmp", path);
    video->frame_size = (size_t)width * (size_t)height * 3;
    video->frames_fd = pair[1];
    video->messages_fd = memfd_create("ffmpeg", MFD_CLOEXEC);
    setsockopt(pair[1], SOL_SOCKET, SO_SNDBUF, &size, sizeof size); /* a wish: any size works */
    int fault = video->messages_fd < 0 ? errno : spawn(video, pair[0], width, height, fps);
    close(pair[0]);
    if (fault) {
        err_set(err, ERR_IO, "%s: cannot start ffmpeg: %s", path, strerror(fault));
        release(video);
        return NULL;
    }
    return video;
}

bool gfx_video_add(GfxVideo *video, const uint8_t *rgb, Err *err) {
    for (size_t done = 0; done < video->frame_size;) {
        ssize_t n = send(video->frames_fd, rgb + done, video->frame_size - done, MSG_NOSIGNAL);
        if (n < 0 && errno != EINTR) {
            int fault = errno;
            close_all(video);
            wait_for_child(video); /* it has ended or will, with its input closed */
            return report(video, fault == EPIPE || fault == ECONNRESET ? "stopped" : strerror(fault), err);
        }
        done += n > 0 ? (size_t)n : 0;
    }
    video->frames++;
    return true;
}

bool gfx_video_finish(GfxVideo *video, Err *err) {
    if (video->frames == 0 && video->child > 0) { /* it did not end by itself over the first frame */
        gfx_video_abort(video);
        return true;
    }
    close_all(video);
    wait_for_child(video);
    bool ok = WIFEXITED(video->status) && WEXITSTATUS(video->status) == 0;
    if (!ok)
        report(video, "failed", err);
    else if (rename(video->temporary, video->path) != 0)
        ok = err_set(err, ERR_IO, "%s: cannot write: %s", video->path, strerror(errno));
    if (!ok)
        unlink(video->temporary);
    release(video);
    return ok;
}

void gfx_video_abort(GfxVideo *video) {
    if (!video)
        return;
    close_all(video);
    if (video->child > 0)
        kill(video->child, SIGKILL);
    wait_for_child(video);
    unlink(video->temporary);
    release(video);
}

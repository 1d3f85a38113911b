/* report.html: one page that shows a run, complete in itself. */
#ifndef SKIFF_APP_REPORT_H
#define SKIFF_APP_REPORT_H

#include "csv.h"
#include "scene.h"

/* What the report shows. hull and probes have no columns where the scene has no bodies or probes. */
typedef struct ReportInput {
    const Scene *scene;
    const SkiffSim *sim;
    const json_t *summary;
    CsvTable steps, ledger, hull, probes;
} ReportInput;

bool report_write(const char *path, const ReportInput *input, Err *err);

#endif

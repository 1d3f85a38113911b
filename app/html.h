/* The frame of the HTML pages that the program writes: self-contained, no scripts. */
#ifndef SKIFF_APP_HTML_H
#define SKIFF_APP_HTML_H

#include <stdio.h>

/* Everything up to the first heading. */
void html_begin(FILE *out, const char *title);
void html_end(FILE *out);

#endif

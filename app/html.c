/* One style for all pages: report.html of a run, the page of a reproduced paper. */
#include "html.h"

#include "svg.h"

static const char style[] =
    ":root{--ink:#1d2733;--soft:#5b6875;--line:#dfe5ea;--page:#f4f7f9;--card:#fff;--blue:#2f6db3}"
    "*{box-sizing:border-box}"
    "body{margin:0;background:var(--page);color:var(--ink);font:16px/1.5 system-ui,-apple-system,'Segoe "
    "UI',Roboto,"
    "'Helvetica Neue',Arial,sans-serif}"
    "main{max-width:1240px;margin:0 auto;padding:24px 16px 48px}"
    "h1{font-size:1.7rem;line-height:1.2;margin:0 0 4px}h2{font-size:1.15rem;margin:34px 0 12px}"
    "p{margin:0 0 6px}.soft{color:var(--soft)}"
    ".status{display:inline-block;padding:1px "
    "10px;border-radius:12px;font-size:.85rem;font-weight:600;vertical-align:3px;"
    "background:#dff1e5;color:#1e6b3a}.status.interrupted{background:#fdf0d5;color:#8a5a00}"
    ".status.diverged{background:#fbdedb;color:#9b231b}"
    ".figures{display:grid;grid-template-columns:repeat(auto-fill,minmax(150px,1fr));gap:10px;margin:18px 0 "
    "0}"
    ".figures div{background:var(--card);border:1px solid var(--line);border-radius:8px;padding:10px 12px}"
    ".figures "
    "b{display:block;font-size:1.3rem;line-height:1.25;font-variant-numeric:tabular-nums;overflow-wrap:"
    "anywhere}"
    ".figures span{font-size:.8rem;color:var(--soft)}"
    ".charts{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,480px),1fr));gap:14px}"
    "figure{margin:0;background:var(--card);border:1px solid var(--line);border-radius:8px;padding:12px 12px "
    "8px}"
    "figcaption{font-weight:600;margin:0 0 6px}svg{display:block;width:100%;height:auto}"
    "svg text{font-family:inherit;fill:var(--soft)}.ticks "
    "text{font-size:13.5px;font-variant-numeric:tabular-nums}"
    "text.label{font-size:13.5px;fill:var(--ink)}.grid line{stroke:#e6ebef}line.axis{stroke:#9aa6b1}"
    ".legend{list-style:none;margin:4px 0 0;padding:0;display:flex;flex-wrap:wrap;gap:2px "
    "16px;font-size:.85rem}"
    ".legend "
    "i{display:inline-block;width:12px;height:12px;border-radius:3px;margin-right:6px;vertical-align:-1px}"
    ".none{color:var(--soft);padding:30px 0;text-align:center}"
    ".wide{overflow-x:auto;background:var(--card);border:1px solid var(--line);border-radius:8px}"
    "table{border-collapse:collapse;width:100%;font-size:.9rem;font-variant-numeric:tabular-nums}"
    "th,td{padding:6px 12px;text-align:right;border-bottom:1px solid var(--line);white-space:nowrap}"
    "th:first-child,td:first-child{text-align:left}tr:last-child "
    "td{border-bottom:0}th{color:var(--soft);font-weight:600}"
    "tr.sum td{font-weight:600}code{font-size:.9em;overflow-wrap:anywhere}"
    "table.dense{font-size:.78rem}.dense th,.dense td{padding:5px 6px}.dense "
    "th{white-space:normal;vertical-align:bottom}"
    ".dense th:first-child,.dense td:first-child{position:sticky;left:0;background:var(--card);"
    "padding-left:12px}"
    "td small{font-weight:400;color:var(--soft)}.wide+.charts{margin-top:14px}.charts+p{margin-top:10px}"
    "@media(max-width:560px){.ticks text,text.label{font-size:17px}main{padding:16px 10px 32px}}"
    "@media print{body{background:#fff}figure,.figures div{break-inside:avoid}}";

void html_begin(FILE *out, const char *title) {
    fputs("<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
          "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><title>",
          out);
    svg_text(out, title);
    fprintf(out, "</title><link rel=\"icon\" href=\"data:,\"><style>%s</style></head><body><main>\n", style);
}

void html_end(FILE *out) {
    fputs("</main></body></html>\n", out);
}

"""How the report looks, on a screen, on a telephone and on paper."""

STYLE = """
:root { --line: #c9ccd1; --soft: #f4f5f7; --ink: #1b1d21; --grey: #5b616b; }
* { box-sizing: border-box; }
body { font: 15px/1.45 system-ui, "Segoe UI", "Noto Sans", sans-serif; color: var(--ink);
  margin: 0 auto; max-width: 1240px; padding: 24px 28px 80px; background: #fff; }
h1 { font-size: 28px; margin: 0 0 4px; } h2 { font-size: 22px; margin: 44px 0 8px;
  border-bottom: 2px solid var(--ink); padding-bottom: 4px; }
h3 { font-size: 17px; margin: 28px 0 6px; } h4 { font-size: 15px; margin: 18px 0 4px; }
p { margin: 6px 0; } .lead { color: var(--grey); max-width: 900px; }
a { color: #0055a4; }
table { border-collapse: collapse; width: 100%; margin: 8px 0 14px; font-size: 13px; }
th, td { text-align: left; vertical-align: top; padding: 5px 8px;
  border-bottom: 1px solid var(--line); overflow-wrap: anywhere; }
th { background: var(--soft); font-weight: 600; border-bottom: 1px solid #8b9099; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
tr.total td { font-weight: 600; border-top: 2px solid #8b9099; }
.items { table-layout: fixed; }
.items col.label { width: 9%; } .items col.words { width: 19%; } .items col.printed { width: 14%; }
.items col.found { width: 20%; } .items col.verdict { width: 12%; } .items col.why { width: 26%; }
.v { font-weight: 600; white-space: normal; padding-left: 10px; border-left: 6px solid #8b9099; }
.v.confirmed { border-left-color: #009e73; }
.v.met-fitted, .v.met-by-construction { border-left: 6px double #009e73; }
.v.in-part { border-left: 6px double #c98500; }
.v.not-confirmed, .v.study-failed { border-left: 6px dashed #b3312c; }
.v.missing { border-left: 6px dotted #b3312c; }
.mark { display: inline-block; white-space: nowrap; border: 1px solid #8b9099; border-radius: 3px;
  padding: 0 5px; margin: 3px 4px 0 0; font-size: 12px; color: var(--grey);
  background: var(--soft); }
tr.repeats td { color: var(--grey); }
small { color: var(--grey); font-weight: 400; }
.scorecard td:first-child { min-width: 170px; }
details { margin: 8px 0; } summary { cursor: pointer; color: #0055a4; }
.quick { background: #fff6dd; border: 1px solid #d9b44a; padding: 8px 12px; max-width: 900px; }
figure { margin: 12px 0 18px; break-inside: avoid; } figure img { max-width: 100%;
  max-height: 620px; border: 1px solid var(--line); display: block; }
figcaption { color: var(--grey); font-size: 13px; margin-top: 4px; }
pre { background: var(--soft); padding: 8px 10px; overflow-x: auto; font-size: 12px;
  white-space: pre-wrap; }
.wide { overflow-x: auto; } .wide table { font-size: 12px; width: auto; min-width: 50%; }
nav ol { columns: 2; font-size: 14px; padding-left: 20px; } ul.plain { padding-left: 18px; }
caption { caption-side: top; text-align: left; font-weight: 600; padding: 4px 0; }
@media screen and (max-width: 720px) {
  body { padding: 14px 14px 60px; } nav ol { columns: 1; }
  .items, .items tbody, .items tr, .items td { display: block; width: auto; }
  .items colgroup, .items thead, .items td:empty { display: none; }
  .items tr { border-top: 2px solid #8b9099; padding: 6px 0; } .items td { border: 0;
  padding: 2px 0; }
  .items td[data-head]::before { content: attr(data-head) ": "; color: var(--grey);
  font-size: 12px; }
  .items .v { display: inline-block; }
  th, td { overflow-wrap: normal; } main > table { display: block; overflow-x: auto; }
}
@page { size: A4 landscape; margin: 12mm; }
@media print {
  body { max-width: none; padding: 0; font-size: 9.5pt; }
  .lead, .quick { max-width: none; } h1 { font-size: 18pt; } h2 { font-size: 14pt; }
  th, td { padding: 3px 6px; } table { font-size: 8.5pt; margin: 4px 0 8px; }
  thead { display: table-header-group; }
  tr, figure, .quick { break-inside: avoid; } h2 { break-before: page; margin-top: 0; }
  h2, h3, h4 { break-after: avoid; } nav { display: none; } a { color: inherit;
  text-decoration: none; } figure img { max-height: 150mm; } .wide { overflow: visible; }
  .wide table { width: 100%; font-size: 7.5pt; }
  .scorecard { font-size: 7pt; margin: 2px 0; } .scorecard th, .scorecard td { padding: 0 6px; }
  .scorecard + .lead { font-size: 7pt; } #scorecard { margin-top: 6px; }
}
"""
"""Verdicts differ by word and by kind of line, not by colour alone."""

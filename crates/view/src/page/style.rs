//! Style of the page, for light and dark mode and for narrow and wide screens.

/// Start of a page up to its heading. `style` extends the common style sheet; `title` is markup.
pub fn opening(title: &str, style: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; \
         style-src 'unsafe-inline'\"/>\n\
         <title>{title}</title>\n<style>\n{STYLE}{style}</style>\n</head>\n<body>\n\
         <h1>{title}</h1>\n"
    )
}

/// Common style sheet.
const STYLE: &str = "\
:root { color-scheme: light dark; --paper: #ffffff; --ink: #1f2328; --faint: #59636e;
  --line: #d1d9e0; --grid: #e3e7ec; --band: #f6f8fa; --native: #0072b2;
  --ipopt: #d55e00; --good: #116329; --bad: #b3151f; }
@media (prefers-color-scheme: dark) {
  :root { --paper: #0d1117; --ink: #e6edf3; --faint: #9aa4af; --line: #30363d;
    --grid: #262c34; --band: #151b23; --native: #58b4f0; --ipopt: #ff9a4d;
    --good: #5fd07a; --bad: #ff8a84; }
}
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.5rem 1rem 3rem; max-width: 66rem; background: var(--paper);
  color: var(--ink); font: 1rem/1.5 'Noto Sans', 'DejaVu Sans', Helvetica, Arial, sans-serif; }
h1 { font-size: 1.6rem; line-height: 1.25; margin: 0 0 .25rem; }
p { margin: .5rem 0; max-width: 46rem; }
.faint, figcaption { color: var(--faint); font-size: .875rem; }
.box { overflow-x: auto; margin: 1rem 0; border: 1px solid var(--line); border-radius: 6px; }
table { border-collapse: collapse; width: 100%; font-size: .8125rem;
  font-variant-numeric: tabular-nums; }
th, td { padding: .3rem .6rem; text-align: left; white-space: nowrap; vertical-align: top; }
th.n, td.n { text-align: right; }
thead th { background: var(--band); font-weight: 600; }
tbody .first th, tbody .first td { border-top: 1px solid var(--line); }
tbody th { font-weight: 600; }
sup { line-height: 0; font-size: .75em; }
.good { color: var(--good); }
.bad { color: var(--bad); font-weight: 700; }
.charts { display: grid; gap: 1.5rem;
  grid-template-columns: repeat(auto-fit, minmax(min(100%, 24rem), 1fr)); }
figure { margin: 0; max-width: 36rem; }
svg { display: block; width: 100%; height: auto; }
.key { white-space: nowrap; margin-right: .8rem; }
.key svg { display: inline-block; width: 26px; height: 10px; vertical-align: baseline;
  margin-right: .3rem; }
svg text { fill: var(--faint); font-size: 12px; }
svg text.axis { fill: var(--ink); font-size: 13px; }
.grid { stroke: var(--grid); fill: none; }
.frame { stroke: var(--line); fill: none; }
.native { stroke: var(--native); stroke-width: 1.8; fill: none; stroke-linejoin: round; }
.ipopt { stroke: var(--ipopt); stroke-width: 1.8; fill: none; }
.guide { stroke: var(--faint); stroke-width: 1.2; stroke-dasharray: 5 4; fill: none; }
@media (max-width: 46rem) {
  .box { overflow-x: visible; border: 0; }
  table, tbody { display: block; }
  thead { display: none; }
  tbody tr { display: flex; flex-wrap: wrap; gap: 0 .9rem; padding: .3rem .2rem;
    border-top: 1px dotted var(--line); }
  tbody tr.first { border-top: 1px solid var(--line); }
  tbody tr.first th, tbody tr.first td { border-top: 0; }
  tbody th { flex: 1 0 100%; }
  th, td, td.n { padding: 0; white-space: normal; text-align: left; }
  tbody tr th { order: -2; }
  td[data-name]::before { content: attr(data-name) ' '; color: var(--faint); }
}
";

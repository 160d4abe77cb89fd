"""How the report looks: on a screen, on a phone, and on A4 paper."""

__all__ = ["STYLE"]

STYLE = """
:root { color-scheme: light; --ink: #1c2430; --soft: #5b6675; --line: #e3e7ec; --paper: #ffffff;
  --ground: #f4f6f8; --accent: #0072b2; --warn: #a84300; --warn-ground: #fff4ea;
  --good: #00664b; --good-ground: #e9f6f1; }
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; text-size-adjust: 100%; }
body { margin: 0; background: var(--ground); color: var(--ink);
  font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", Arial, sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 28px 24px 56px; }
header { margin-bottom: 20px; }
h1 { font-size: 1.75rem; line-height: 1.25; margin: 0 0 4px; overflow-wrap: anywhere; }
h2 { font-size: 1.2rem; margin: 0 0 6px; }
h3 { font-size: 1rem; margin: 18px 0 6px; }
p { margin: 0 0 10px; max-width: 78ch; overflow-wrap: break-word; }
.soft, figcaption, caption { color: var(--soft); }
section { background: var(--paper); border: 1px solid var(--line); border-radius: 10px;
  padding: 20px 22px; margin: 0 0 18px; }
.banner { border-left: 6px solid var(--good); background: var(--good-ground); border-radius: 6px;
  padding: 16px 22px; margin: 0 0 18px; }
.banner.bad { border-color: var(--warn); background: var(--warn-ground); }
.banner h2 { font-size: 1.3rem; } .banner p { margin: 4px 0 0; }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(165px, 1fr)); gap: 12px;
  margin: 0 0 18px; padding: 0; }
.cards div { background: var(--paper); border: 1px solid var(--line); border-radius: 10px;
  padding: 12px 16px; }
.cards dt { color: var(--soft); font-size: .85rem; }
.cards dd { margin: 2px 0 0; font-size: 1.1rem; font-weight: 650; line-height: 1.25;
  font-variant-numeric: tabular-nums; overflow-wrap: anywhere; }
.cards small { display: block; font-size: .82rem; font-weight: 400; color: var(--soft); }
.figures { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 440px), 1fr));
  gap: 22px; align-items: start; margin-top: 12px; }
figure { margin: 0; min-width: 0; }
figure img { display: block; width: 100%; height: auto; }
figcaption { font-size: .9rem; margin-top: 4px; }
a { color: var(--accent); } a.data { white-space: nowrap; }
b.pass { color: var(--good); } b.fail, b.not { color: var(--warn); }
.scroll { overflow-x: auto; margin: 8px 0 12px; }
table { border-collapse: collapse; font-size: .92rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; padding-bottom: 6px; font-size: .9rem; }
th, td { text-align: right; padding: 5px 12px; border-bottom: 1px solid var(--line);
  white-space: nowrap; vertical-align: top; }
th:first-child, td:first-child { text-align: left; padding-left: 0; }
th.text, td.text { text-align: left; }
td.hash { font: .82em ui-monospace, SFMono-Regular, Menlo, Consolas, monospace; }
td.long { white-space: normal; min-width: 14em; }
td span { color: var(--soft); }
thead th { border-bottom: 2px solid var(--ink); font-weight: 600; }
tbody tr:hover { background: var(--ground); }
.warn { background: var(--warn-ground); border-left: 4px solid var(--warn); padding: 10px 14px;
  border-radius: 4px; margin: 0 0 12px; max-width: none; }
pre { background: var(--ground); border-radius: 6px; padding: 12px 14px; overflow-x: auto;
  font: 13px/1.5 ui-monospace, SFMono-Regular, Menlo, Consolas, monospace; margin: 8px 0; }
details { margin-top: 8px; } summary { cursor: pointer; font-weight: 600; }
footer { color: var(--soft); font-size: .85rem; }
@media (max-width: 600px) { main { padding: 16px 12px 40px; } section { padding: 16px 14px; }
  h1 { font-size: 1.4rem; } .cards { grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 8px; }
  .cards div { padding: 10px 12px; } .cards dd { font-size: 1.1rem; }
  table { font-size: .82rem; } th, td { padding: 4px 7px; } td span { display: block; }
  th { white-space: normal; } th:first-child, td:first-child { white-space: normal; } }
@page { size: A4; margin: 14mm 13mm; }
@media print {
  html { font-size: 80%; -webkit-print-color-adjust: exact; print-color-adjust: exact; }
  body { background: none; font-size: 10pt; } main { max-width: none; padding: 0; }
  section { border: 0; padding: 0; margin: 0 0 14pt; }
  h1, h2, h3 { break-after: avoid; } p { orphans: 3; widows: 3; }
  .banner, .cards, .cards div, figure, .warn, .short { break-inside: avoid; }
  .cards { grid-template-columns: repeat(4, 1fr); gap: 6pt; } .cards div { padding: 6pt 8pt; }
  .figures { display: block; } figure { margin: 0 0 12pt; }
  figure img { width: auto; max-width: 100%; max-height: 108mm; margin: 0 auto; }
  figure.tall img { max-height: 215mm; }
  a.data { display: none; }
  .scroll { overflow: visible; } table { font-size: 8pt; max-width: 100%; }
  th, td { padding: 2.5pt 6pt; white-space: normal; overflow-wrap: break-word; }
  th.hash, td.hash { overflow-wrap: anywhere; font-size: 7pt; }
  thead { display: table-header-group; } tr { break-inside: avoid; }
  /* What a click opens on a screen stands open on paper; long lines are wrapped, not cut. */
  details::details-content { display: block; content-visibility: visible; block-size: auto; }
  pre { white-space: pre-wrap; overflow-wrap: anywhere; overflow: visible; font-size: 7.5pt; }
}
"""

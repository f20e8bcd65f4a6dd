// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string_view>

/// Style sheets of the report page and of charts.
namespace stillmap {

/// Colors of the light scheme, which is also the one for print and for charts in files.
inline constexpr std::string_view kLightColors = R"css(
  --page: #f4f5f7; --card: #ffffff; --ink: #1c2530; --soft: #5d6b7a; --line: #dfe4ea; --grid: #e9edf1;
  --accent: #1f6fc2; --accent-soft: #1f6fc233; --good: #2f9e6e; --bad: #d64545; --warn: #b7791f; --late: #8e6bbf;
  --truth: #8b97a5; --shadow: 0 1px 2px #1c253014, 0 4px 16px #1c25300d;
)css";

/// Rules for the elements of a chart.
inline constexpr std::string_view kChartStyle = R"css(
svg text { fill: var(--soft); font-family: system-ui, "Noto Sans", "DejaVu Sans", sans-serif; font-size: 13px; }
svg .label { font-size: 13.5px; } svg .tick { font-size: 12.5px; font-variant-numeric: tabular-nums; }
svg .grid { stroke: var(--grid); } svg .frame { fill: none; stroke: var(--line); }
svg .truth { fill: none; stroke: var(--truth); stroke-width: 1.6; stroke-linejoin: round; }
svg .estimate { fill: none; stroke: var(--accent); stroke-width: 2; stroke-linejoin: round; stroke-linecap: round; }
svg .start { fill: var(--good); stroke: var(--card); } svg .end { fill: var(--bad); stroke: var(--card); }
svg .area { fill: var(--accent-soft); } svg .curve { fill: none; stroke: var(--accent); stroke-width: 1.5; stroke-linejoin: round; }
svg .reference { stroke: var(--soft); stroke-dasharray: 5 4; } svg .reference-label { fill: var(--ink); font-size: 13px; font-weight: 600; paint-order: stroke; stroke: var(--card); stroke-width: 4px; }
svg .event { stroke: var(--warn); stroke-width: 1.5; stroke-dasharray: 2 3; } svg .hover { fill: transparent; }
svg .tracked { fill: var(--good); } svg .lost, svg .dynamic { fill: var(--bad); } svg .dropped { fill: var(--late); } svg .keyframe { stroke: var(--accent); stroke-width: 1.4; }
svg .bar { fill: var(--accent); } svg .bar-p95 { fill: var(--accent-soft); }
svg .box { fill-opacity: 0.75; } svg .median { fill: none; stroke: var(--ink); stroke-width: 2; }
svg .paper { fill: var(--card); } svg .strong { fill: var(--ink); font-weight: 600; } svg .heading { fill: var(--ink); font-size: 20px; font-weight: 600; }
svg .error { stroke: var(--bad); stroke-width: 1; } svg .path { fill: none; stroke: var(--accent); stroke-width: 1.6; stroke-linejoin: round; }
svg .span { stroke: var(--card); stroke-width: 0.6; } svg .span-name { fill: #1c2530; font-size: 11px; } svg .frame-start { stroke: var(--truth); } svg .marked { fill: none; stroke: var(--ink); stroke-width: 1.5; }
)css";

/// Rules for the page: one column of cards, light or dark as the reader's system is, A4 in print.
inline constexpr std::string_view kPageStyle = R"css(
@media (prefers-color-scheme: dark) {
  :root {
    --page: #12161b; --card: #1b2128; --ink: #e6ebf0; --soft: #97a5b3; --line: #2f3842; --grid: #29313a;
    --accent: #63a9ee; --accent-soft: #63a9ee33; --good: #4cc38a; --bad: #f06a6a; --warn: #e0a94a; --late: #b294e0;
    --truth: #7d8a98; --shadow: none;
  }
}
* { box-sizing: border-box; }
body {
  margin: 0; background: var(--page); color: var(--ink); line-height: 1.5; font-size: 16px;
  font-family: system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", "DejaVu Sans", sans-serif;
}
main { max-width: 1120px; margin: 0 auto; padding: 36px 20px 64px; }
header { margin-bottom: 22px; }
h1 { font-size: 30px; line-height: 1.2; margin: 0 0 6px; letter-spacing: -0.015em; overflow-wrap: anywhere; }
h2 { font-size: 18px; margin: 0 0 4px; letter-spacing: -0.005em; }
h3 { font-size: 14px; font-weight: 600; margin: 0 0 4px; color: var(--soft); }
p { margin: 0 0 10px; }
.subtitle, .note { color: var(--soft); }
.note { font-size: 14px; }
.chips { display: flex; flex-wrap: wrap; gap: 8px; margin-top: 10px; }
.chip { font-size: 13px; border: 1px solid var(--line); border-radius: 99px; padding: 2px 12px; background: var(--card); }
.chip b { font-weight: 600; }
.tiles { display: flex; flex-wrap: wrap; gap: 12px; margin-bottom: 16px; }
.tile, section { background: var(--card); border: 1px solid var(--line); border-radius: 12px; box-shadow: var(--shadow); }
.tile { padding: 14px 16px 12px; flex: 1 1 220px; }
.tile .name { font-size: 13px; color: var(--soft); }
.tile .value { font-size: 27px; font-weight: 650; letter-spacing: -0.02em; line-height: 1.25; font-variant-numeric: tabular-nums; white-space: nowrap; }
.tile .unit { font-size: 15px; font-weight: 500; color: var(--soft); margin-left: 4px; letter-spacing: 0; }
.tile .detail { font-size: 13px; color: var(--soft); }
.tile.good .value { color: var(--good); } .tile.bad .value { color: var(--bad); }
section { padding: 20px 22px; margin-bottom: 16px; }
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: 18px; }
.legend { display: flex; flex-wrap: wrap; align-items: center; gap: 6px 22px; font-size: 14px; color: var(--soft); margin-top: 4px; }
.legend span { display: inline-flex; align-items: center; gap: 8px; }
.legend i { display: inline-block; width: 24px; height: 0; border-top: 3px solid; }
.legend i.dot { width: 10px; height: 10px; border: 0; border-radius: 50%; background: var(--good); }
.legend i.square { width: 9px; height: 9px; border: 0; background: var(--bad); }
.legend i.block { width: 14px; height: 12px; border: 0; border-radius: 3px; }
.legend i.ring { width: 11px; height: 11px; border: 2px solid; border-radius: 50%; } .legend i.small { width: 6px; height: 6px; }
.legend i.outline { width: 14px; height: 12px; border: 2px solid var(--soft); border-radius: 3px; }
a { color: var(--accent); } a.chip { text-decoration: none; }
figure + figure { margin-top: 14px; } .gallery figure { margin-top: 0; }
.colorbar { width: 340px; max-width: 100%; }
svg[role] { display: block; width: 100%; height: auto; }
.scroll { overflow-x: auto; }
.on-narrow { display: none; }
@media screen and (max-width: 760px) { .scroll svg { min-width: 680px; } .on-wide { display: none; } .on-narrow { display: block; } }
table { border-collapse: collapse; width: 100%; font-size: 14.5px; font-variant-numeric: tabular-nums; }
th { text-align: right; font-weight: 600; color: var(--soft); font-size: 13px; padding: 6px 10px; border-bottom: 1px solid var(--line); white-space: nowrap; }
td { text-align: right; padding: 6px 10px; border-bottom: 1px solid var(--grid); white-space: nowrap; }
th:first-child, td:first-child { text-align: left; padding-left: 0; }
tr:last-child td { border-bottom: 0; }
td.text { text-align: left; white-space: normal; overflow-wrap: anywhere; } th.text { text-align: left; }
td b { font-weight: 650; }
figure { margin: 0; }
.untrusted { padding: 12px 14px; border-radius: 8px; border: 2px solid #c0392b; }
figure img { display: block; width: 100%; height: auto; border-radius: 8px; border: 1px solid var(--line); }
figcaption { font-size: 13.5px; color: var(--soft); margin-top: 6px; }
.gallery { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(420px, 100%), 1fr)); gap: 16px; margin-top: 8px; }
details summary { cursor: pointer; font-weight: 600; font-size: 18px; }
pre { font-size: 13px; line-height: 1.45; overflow-x: auto; background: var(--page); border: 1px solid var(--line); border-radius: 8px; padding: 14px; font-family: ui-monospace, "DejaVu Sans Mono", Menlo, Consolas, monospace; }
footer { color: var(--soft); font-size: 13px; margin-top: 22px; text-align: center; }
@media (max-width: 760px) { .pair { grid-template-columns: 1fr; } section { padding: 16px 14px; } h1 { font-size: 24px; }
  .scroll th:first-child, .scroll td:first-child { position: sticky; left: 0; background: var(--card); white-space: normal; overflow-wrap: anywhere; min-width: 64px; max-width: 30vw; }
  th, td { padding: 6px; } }
@media print {
  @page { size: A4; margin: 14mm; }
  body { font-size: 12px; print-color-adjust: exact; -webkit-print-color-adjust: exact; }
  main { padding: 0; max-width: none; }
  section, .tile, figure { break-inside: avoid; } section { padding: 12px 14px; margin-bottom: 10px; }
  .tile { flex-basis: 120px; padding: 8px 10px; } .tile .value { font-size: 18px; }
  .gallery { grid-template-columns: 1fr 1fr; }
}
)css";

}  // namespace stillmap

// SPDX-License-Identifier: Apache-2.0
#include "page_style.h"

#include <string_view>

#include "series_style.h"

namespace sarnerf {
namespace {

/// Neither < nor & occurs, so that the style sheet is the same in HTML and in XML.
constexpr std::string_view kStyle = R"(
:root {
  color-scheme: light dark;
  --paper: #ffffff; --panel: #f5f6f8; --ink: #1a1a1a; --quiet: #555b63; --rule: #d9dce1;
  --accent: #005a8f; --warning: #8a4b00; --warning-paper: #fff5e5;
}
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #16191d; --panel: #1f2329; --ink: #e8eaed; --quiet: #a9b0b9; --rule: #3a4049;
    --accent: #6cb8ea; --warning: #f0b35c; --warning-paper: #2b2417;
  }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body {
  margin: 0; background: var(--paper); color: var(--ink);
  font: 16px/1.55 system-ui, "Segoe UI", "Helvetica Neue", Arial, "DejaVu Sans", sans-serif;
  overflow-wrap: break-word;
}
header, main { max-width: 1040px; margin: 0 auto; padding: 0 32px; }
header { padding-top: 40px; }
main { padding-bottom: 64px; }
h1 { font-size: 30px; line-height: 1.2; margin: 0 0 8px; letter-spacing: -0.01em; }
h2 {
  font-size: 21px; line-height: 1.3; margin: 48px 0 12px; padding-bottom: 6px;
  border-bottom: 1px solid var(--rule);
}
p { margin: 12px 0; max-width: 46em; }
header p { color: var(--quiet); font-size: 17px; margin: 0 0 12px; }
nav ul {
  list-style: none; margin: 0; padding: 0; display: flex; flex-wrap: wrap; gap: 4px 20px;
  font-size: 14px;
}
nav li { min-width: 0; overflow-wrap: anywhere; }
a { color: var(--accent); }
.notice {
  border-left: 4px solid var(--accent); background: var(--panel); padding: 10px 16px;
  border-radius: 0 4px 4px 0; max-width: none;
}
.warning { border-color: var(--warning); background: var(--warning-paper); }
.warning strong { color: var(--warning); }
.figures {
  list-style: none; display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr));
  gap: 12px; padding: 0; margin: 24px 0;
}
.figures li { background: var(--panel); border-radius: 6px; padding: 12px 14px; }
.figures strong {
  display: block; font-size: 22px; line-height: 1.25; font-weight: 650;
  font-variant-numeric: tabular-nums;
}
.figures span {
  display: block; color: var(--quiet); font-size: 14px; line-height: 1.35; margin-top: 4px;
}
figure { margin: 24px 0; }
figcaption, caption, summary {
  color: var(--quiet); font-size: 14px; line-height: 1.45; text-align: left;
}
figcaption { margin-top: 8px; max-width: 58em; }
caption { padding-bottom: 8px; }
summary { cursor: pointer; padding: 8px 0; color: var(--accent); }
.table figcaption { margin: 0 0 8px; }
.scroll { overflow-x: auto; margin: 0; }
details .scroll { margin: 8px 0 20px; }
table {
  border-collapse: collapse; font-size: 15px; line-height: 1.4;
  font-variant-numeric: tabular-nums;
}
th, td {
  padding: 6px 14px; text-align: left; white-space: nowrap; border-bottom: 1px solid var(--rule);
  font-weight: 400;
}
th:first-child { padding-left: 2px; }
thead th {
  color: var(--quiet); font-size: 13.5px; vertical-align: bottom; white-space: normal;
  border-bottom: 2px solid var(--rule);
}
.right { text-align: right; }
.ours th, .ours td { font-weight: 700; background: var(--panel); }
.facts { max-width: 100%; }
.facts th { color: var(--quiet); min-width: 9em; }
.facts th, .facts td { white-space: normal; vertical-align: top; overflow-wrap: anywhere; }
.plot svg { display: block; width: 100%; height: auto; }
.plot .wide { max-width: 860px; }
.plot .narrow { display: none; max-width: 460px; }
.pictures {
  display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 160px), 1fr));
  gap: 12px;
}
.pictures div { min-width: 0; }
.pictures span { display: block; font-size: 14px; font-weight: 600; margin-bottom: 4px; }
.pictures img {
  display: block; width: 100%; height: auto; max-height: 480px; object-fit: contain;
  object-position: left top;
}
.pictures .flat { height: 24px; object-fit: fill; }
.pictures .upright { width: 24px; height: 480px; object-fit: fill; }
.coarse { image-rendering: pixelated; }
.scales {
  display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 280px), 1fr));
  gap: 12px 32px; margin: 20px 0; font-size: 13.5px;
}
.scales img {
  display: block; width: 100%; height: 14px; margin: 4px 0 2px; border: 1px solid var(--rule);
}
.labels {
  display: flex; justify-content: space-between; gap: 8px; color: var(--quiet);
  font-variant-numeric: tabular-nums;
}
@media (max-width: 640px) {
  header, main { padding-left: 16px; padding-right: 16px; }
  header { padding-top: 24px; }
  h1 { font-size: 25px; }
  .figures { grid-template-columns: repeat(auto-fit, minmax(130px, 1fr)); }
  th, td { padding: 6px 10px; }
  .facts th { min-width: 8.5em; }
  .plot .wide { display: none; }
  .plot .narrow { display: block; }
}
@media print {
  figure, .figures, .scroll { break-inside: avoid; }
  h2 { break-after: avoid; }
  nav { display: none; }
}
)";

/// A colour of the plots replaced, wherever it paints.
std::string repainted(std::string_view from, std::string_view to) {
  std::string rules;
  for (const std::string paints : {"fill", "stroke"}) {
    rules += "  .plot [" + paints + "=\"" + std::string(from) + "\"] { " + paints + ": " +
             std::string(to) + "; }\n";
  }
  return rules;
}

}  // namespace

std::string page_style() {
  return std::string(kStyle) + "@media screen and (prefers-color-scheme: dark) {\n" +
         "  .plot text { fill: var(--ink); }\n" + repainted(kPaper, "var(--paper)") +
         repainted(kInk, "var(--ink)") + repainted(kQuietInk, "var(--quiet)") +
         repainted(kGridInk, "#2d323a") + repainted(kBorderInk, "var(--rule)") + "}\n";
}

}  // namespace sarnerf

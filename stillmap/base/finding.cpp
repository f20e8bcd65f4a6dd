// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/finding.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/format.h>

namespace stillmap {

namespace {

constexpr std::array kNames = {"ok", "note", "warning", "untrusted", "error"};

}  // namespace

const char* name_of(Severity severity) { return kNames.at(static_cast<std::size_t>(severity)); }

Severity severity_named(const std::string& name) {
  const auto found = std::find(kNames.begin(), kNames.end(), name);
  if (found == kNames.end())
    throw Error("is no severity of a finding", name,
                fmt::format("use {}", fmt::join(kNames, ", ")));
  return static_cast<Severity>(found - kNames.begin());
}

std::string Finding::text() const { return fix.empty() ? message : message + "; " + fix; }

Finding make_finding(FindingCode code, std::string message, std::string fix,
                     std::map<std::string, double> evidence) {
  const FindingKind& kind = code.kind();
  return {std::string(kind.code), kind.severity, std::move(message), std::move(fix),
          std::move(evidence)};
}

Finding with_severity(Severity severity, Finding finding) {
  finding.severity = severity;
  return finding;
}

Severity worst(std::span<const Finding> findings) {
  Severity worst = Severity::kOk;
  for (const Finding& finding : findings) worst = std::max(worst, finding.severity);
  return worst;
}

std::vector<Finding> findings_with(Severity severity, std::span<const Finding> findings) {
  std::vector<Finding> chosen;
  std::copy_if(findings.begin(), findings.end(), std::back_inserter(chosen),
               [&](const Finding& finding) { return finding.severity == severity; });
  return chosen;
}

std::vector<Finding> findings_on_trajectory(std::span<const Finding> findings) {
  std::vector<Finding> chosen = findings_with(Severity::kUntrusted, findings);
  std::erase_if(chosen, [](const Finding& finding) {
    return finding.code == "floor-unknown" || finding.code == "zones-tilted" ||
           finding.code == "events-lost";
  });
  return chosen;
}

std::vector<std::string> texts_of(std::span<const Finding> findings) {
  std::vector<std::string> texts;
  for (const Finding& finding : findings) texts.push_back(finding.text());
  return texts;
}

void append(std::vector<Finding> more, std::vector<Finding>& findings) {
  std::move(more.begin(), more.end(), std::back_inserter(findings));
}

std::string finding_kinds_markdown() {
  std::string text = "| code | severity | meaning |\n|---|---|---|\n";
  for (const FindingKind& kind : kFindingKinds)
    text += fmt::format("| `{}` | {} | {} |\n", kind.code, name_of(kind.severity), kind.meaning);
  return text;
}

}  // namespace stillmap

// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"

#include <nlohmann/json.hpp>

namespace stillmap {

/// Writes code, severity, message, fix (null: none) and evidence.
inline void to_json(nlohmann::json& json, const Finding& finding) {
  json = {{"code", finding.code},
          {"severity", name_of(finding.severity)},
          {"message", finding.message},
          {"fix", nullptr},
          {"evidence", finding.evidence}};
  if (!finding.fix.empty()) json["fix"] = finding.fix;
}

/// Reads what to_json() wrote. Throws nlohmann::json::exception for other content.
inline void from_json(const nlohmann::json& json, Finding& finding) {
  json.at("code").get_to(finding.code);
  json.at("message").get_to(finding.message);
  if (!json.at("fix").is_null()) json.at("fix").get_to(finding.fix);
  json.at("evidence").get_to(finding.evidence);
  finding.severity = severity_named(json.at("severity").get<std::string>());
}

}  // namespace stillmap

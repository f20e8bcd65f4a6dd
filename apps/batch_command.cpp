// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/fnv1a.hpp"
#include "stillmap/base/json_text.hpp"
#include "stillmap/base/parallel_for.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/base/unicode.hpp"
#include "stillmap/pipeline/saved_map.hpp"
#include "stillmap/report/html_page.hpp"
#include "stillmap/report/svg.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <glob.h>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <sstream>
#include <string>
#include <unistd.h>
#include <vector>

#include "child_process.hpp"
#include "command_tree.hpp"
#include "commands.hpp"
#include "interrupt.hpp"
#include "output_file.hpp"
#include "progress.hpp"
#include "run_request.hpp"
#include "terminal.hpp"
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

struct BatchArguments : RunRequest {
  std::vector<std::string> recordings;  // folders, files and patterns
  std::string list, merge;
  int jobs = 1;
  std::string slurm;  // options of sbatch
  bool use_slurm = false, dry_run = false;
  std::optional<int> only;  // number of the only job that is run
};

constexpr const char* kTable = "results.csv";
constexpr int kAttempts = 3;  // of a job that a signal ends, such as one for lack of memory
constexpr int kSignal = 128;  // larger codes are those of signals: see run_program()

/// A recording, and the name of its job and of its folder of results.
struct Job {
  std::string recording, name;
};

/// How a job ended.
struct JobEnd {
  std::string key;  ///< Hash of program, options and recording.
  int code = kFailure;
  double seconds = 0;
  std::map<std::string, std::uintmax_t> files = {};  ///< The results, and their sizes [bytes].
};

// ---- the jobs

/// Returns the recordings that a pattern of the shell names, or the word itself.
std::vector<std::string> named_by(const std::string& word) {
  if (fs::exists(word) || word.find_first_of("*?[") == std::string::npos) return {word};
  glob_t found{};
  const int code = ::glob(word.c_str(), 0, nullptr, &found);
  std::vector<std::string> names(found.gl_pathv, found.gl_pathv + found.gl_pathc);
  ::globfree(&found);
  if (code != 0)
    throw Error("no recording has such a name", word, "check the pattern and its folder");
  return names;
}

std::string without_blanks_around(const std::string& line) {
  constexpr const char* kBlanks = " \t\r";
  const std::size_t first = line.find_first_not_of(kBlanks);
  if (first == std::string::npos) return {};
  return line.substr(first, line.find_last_not_of(kBlanks) + 1 - first);
}

fs::path absolute_path(const std::string& name) {
  const fs::path path = fs::absolute(name).lexically_normal();
  return path.has_filename() ? path : path.parent_path();
}

/// Returns the recordings in the order in which they were named, each once.
std::vector<std::string> recordings_of(const BatchArguments& arguments) {
  std::vector<std::string> words = arguments.recordings;
  if (!arguments.list.empty()) {
    std::istringstream lines(as_utf8(read_file(arguments.list)));
    for (std::string line; std::getline(lines, line);) {
      const std::string word = without_blanks_around(line);
      if (!word.empty() && word.front() != '#') words.push_back(word);
    }
  }
  std::vector<std::string> recordings;
  std::set<fs::path> known;
  for (const std::string& word : words) {
    for (const std::string& recording : named_by(word)) {
      if (known.insert(absolute_path(recording)).second) recordings.push_back(recording);
    }
  }
  if (recordings.empty())
    throw Error("no recordings were named", "batch", "stillmap batch 'recordings/*' --out results");
  return recordings;
}

/// Returns the last names of a path, as one word.
std::string last_names(const fs::path& path, std::size_t count) {
  std::vector<std::string> names;
  for (const fs::path& name : absolute_path(path)) {
    if (name.has_filename() && name.has_relative_path()) names.push_back(name.string());
  }
  const auto first = names.end() - static_cast<std::ptrdiff_t>(std::min(count, names.size()));
  return fmt::format("{}", fmt::join(first, names.end(), "_"));
}

/// Returns the jobs; recordings of one name are told apart by the folders that they are in.
std::vector<Job> jobs_of(const BatchArguments& arguments) {
  constexpr std::size_t kFolders = 8;
  std::vector<Job> jobs;
  for (const std::string& recording : recordings_of(arguments))
    jobs.push_back({recording, sequence_name(recording)});
  for (std::size_t folders = 1; folders <= kFolders; ++folders) {
    std::map<std::string, std::size_t> jobs_of_name;
    for (const Job& job : jobs) ++jobs_of_name[job.name];
    for (Job& job : jobs) {
      if (jobs_of_name[job.name] > 1) job.name = last_names(job.recording, folders + 1);
    }
  }
  std::map<std::string, std::string> first;
  for (const Job& job : jobs) {
    const auto [found, added] = first.emplace(job.name, job.recording);
    if (!added)
      throw Error(fmt::format("two recordings would have the results {}", job.name),
                  found->second + ", " + job.recording, "rename one, or run it in another batch");
  }
  return jobs;
}

/// Throws Error if the results would be in a recording.
void require_outside(const std::vector<Job>& jobs, const fs::path& out) {
  for (const Job& job : jobs) {
    const fs::path recording = absolute_path(job.recording);
    if (std::ranges::mismatch(recording, out).in1 == recording.end())
      throw Error("is in the recording " + job.recording, out.string(),
                  "name another folder with --out");
  }
}

/// Returns the options of `stillmap run` in a parsed command line, as words.
std::vector<std::string> run_words(const CLI::App& command) {
  const std::array<std::string, 9> own{"list",  "merge", "jobs", "slurm", "dry-run",
                                       "quiet", "out",   "only", "help"};
  std::vector<std::string> words;
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() == 0 || option->get_lnames().empty()) continue;
    const std::string& name = option->get_lnames().front();
    if (std::find(own.begin(), own.end(), name) != own.end()) continue;
    const std::vector<std::string>& values = option->results();
    if (option->get_expected_max() == 0) {
      words.push_back("--" + name);
    } else if (option->get_delimiter() != 0) {
      words.insert(words.end(), {"--" + name, fmt::format("{}", fmt::join(values, ","))});
    } else {
      for (const std::string& value : values) words.insert(words.end(), {"--" + name, value});
    }
  }
  return words;
}

// ---- what is done already

/// Continues a hash with the content of a file, or the names and contents below a folder.
std::uint64_t with_content(const fs::path& path, std::uint64_t hash) {
  if (is_file(path)) {
    std::ifstream file = open_file(path);
    std::string part(std::size_t{1} << 20, '\0');
    while (file.read(part.data(), static_cast<std::streamsize>(part.size())), file.gcount() > 0)
      hash = fnv1a(std::string_view(part).substr(0, static_cast<std::size_t>(file.gcount())), hash);
    return hash;
  }
  if (!fs::is_directory(path)) return hash;
  std::vector<fs::path> below;
  for (const auto& entry : fs::recursive_directory_iterator(path)) below.push_back(entry.path());
  std::sort(below.begin(), below.end());
  for (const fs::path& file : below) {
    hash = fnv1a(file.lexically_relative(path).string(), hash);
    if (is_file(file)) hash = with_content(file, hash);
  }
  return hash;
}

fs::path program() { return fs::read_symlink("/proc/self/exe"); }

/// Runs the jobs of a batch, and keeps how they ended in OUT/jobs.
class Batch {
 public:
  Batch(const BatchArguments& arguments, std::vector<std::string> options)
      : out_(fs::absolute(arguments.out).lexically_normal()),
        options_(std::move(options)),
        of_options_(with_content(program(), fnv1a(""))) {
    make_output_folder(out_ / "jobs");
    for (const std::string& word : options_)
      of_options_ = with_content(word, fnv1a(word, of_options_));
  }

  const fs::path& out() const { return out_; }
  fs::path results_of(const Job& job) const { return out_ / job.name; }

  /// Throws Error if a batch put the results of another recording where those of a job would be.
  void require_own(const Job& job) const {
    const std::string before = json_of(job).value("recording", "");
    if (before.empty() || before == absolute_path(job.recording)) return;
    throw Error("has the results of " + before + ", not of " + job.recording,
                results_of(job).string(), "name another folder with --out, or remove this one");
  }

  /// Runs a job unless its results are there already; again if a signal ended it.
  JobEnd run(const Job& job) const {
    JobEnd end{
        fmt::format("{:016x}", with_content(job.recording, fnv1a(job.recording, of_options_)))};
    if (const JobEnd before = read_end(job); before.key == end.key && has_results(before.code) &&
                                             std::ranges::includes(files_of(job), before.files))
      return before;
    const Stopwatch watch;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      std::vector<std::string> words{program().string(), "run",   job.recording,
                                     "--quiet",          "--out", results_of(job).string()};
      words.insert(words.end(), options_.begin(), options_.end());
      // A job that was killed leaves a journal, which is this batch's.
      if (is_file(file_of(job, ".json")) && is_file(results_of(job) / kRunJournal))
        words.emplace_back("--force");
      write_end(job, end);
      end.code = run_program(words, file_of(job, ".log"));
      if (end.code <= kSignal || end.code == kInterrupted || interrupted()) break;
    }
    end.seconds = watch.milliseconds() / 1000;
    end.files = files_of(job);
    write_end(job, end);
    return end;
  }

  fs::path file_of(const Job& job, const char* extension) const {
    return out_ / "jobs" / (job.name + extension);
  }

 private:
  /// Returns the names and sizes of the results.
  std::map<std::string, std::uintmax_t> files_of(const Job& job) const {
    std::map<std::string, std::uintmax_t> files;
    if (!fs::is_directory(results_of(job))) return files;
    for (const auto& entry : fs::directory_iterator(results_of(job))) {
      if (entry.is_regular_file()) files[entry.path().filename().string()] = entry.file_size();
    }
    return files;
  }

  static bool has_results(int code) { return code == kSuccess || code == kDoubtful; }

  void write_end(const Job& job, const JobEnd& end) const {
    write_file(file_of(job, ".json"),
               json_text({{"recording", absolute_path(job.recording).string()},
                          {"key", end.key},
                          {"code", end.code},
                          {"seconds", end.seconds},
                          {"files", end.files}}) +
                   "\n");
  }

  /// Returns what write_end() wrote, or an empty object.
  nlohmann::json json_of(const Job& job) const {
    const fs::path file = file_of(job, ".json");
    if (!is_file(file)) return nlohmann::json::object();
    const auto json = nlohmann::json::parse(read_file(file), nullptr, /*allow_exceptions=*/false);
    return json.is_object() ? json : nlohmann::json::object();
  }

  JobEnd read_end(const Job& job) const {
    const nlohmann::json json = json_of(job);
    return {json.value("key", ""), json.value("code", int{kFailure}), json.value("seconds", 0.0),
            json.value("files", std::map<std::string, std::uintmax_t>())};
  }

  const fs::path out_;
  const std::vector<std::string> options_;
  std::uint64_t of_options_;  // hash of program and options
};

std::vector<JobEnd> run_all(const Batch& batch, const std::vector<Job>& jobs, int threads) {
  // Those that an interruption leaves out keep this code.
  std::vector<JobEnd> ends(jobs.size(), JobEnd{.key = {}, .code = kInterrupted});
  Progress progress("mapping", jobs.size(), "recordings");
  std::mutex mutex;
  parallel_for(jobs.size(), threads, [&] {
    return [&](std::size_t i) {
      if (interrupted()) return;
      try {
        ends[i] = batch.run(jobs[i]);
      } catch (const std::exception& error) {
        const std::scoped_lock lock(mutex);
        ends[i].code = kFailure;
        print_error("stillmap: {}\n", error.what());
      }
      const std::scoped_lock lock(mutex);
      progress.step(fmt::format("{} {}", jobs[i].name, ends[i].code == kSuccess ? "" : "failed"));
    };
  });
  return ends;
}

// ---- the table

/// A row of the table; texts are empty where there is nothing to tell.
using Row = std::array<std::string, 9>;
const Row kColumns{"recording",         "status",       "frames",
                   "with a pose",       "ATE [m]",      "time [s]",
                   "findings or error", "localized in", "name"};

std::string status_of(int code) {
  switch (code) {
    case kSuccess:
      return "done";
    case kDoubtful:
      return "do not trust";
    case kInterrupted:
      return "interrupted";
    default:
      return "failed";
  }
}

/// Returns the error in what a failed job printed: the last line of the kind; empty without one.
std::string error_in(const fs::path& log) {
  constexpr std::string_view kError = "stillmap: ";
  std::string error;
  if (!is_file(log)) return error;
  std::istringstream lines(as_utf8(read_file(log)));
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(kError)) error = line.substr(kError.size());
  }
  return error;
}

Row row_of(const Batch& batch, const Job& job, const JobEnd& end) {
  Row row;
  row[0] = job.recording, row[1] = status_of(end.code);
  row[5] = fmt::format("{:.1f}", end.seconds), row[8] = job.name;
  const fs::path file = batch.results_of(job) / kRunSummary;
  if (row[1] == "failed") row[6] = error_in(batch.file_of(job, ".log"));
  if (end.code == kFailure || !is_file(file)) return row;
  const auto json = nlohmann::json::parse(read_file(file));
  row[2] = fmt::format("{}", json.at("frames").at("total").get<int>());
  row[3] = fmt::format("{}", json.at("frames").at("tracked").get<int>());
  if (json.contains("evaluation"))
    row[4] =
        fmt::format("{:.4f}", json["evaluation"]["ate"]["translation_m"]["rmse"].get<double>());
  if (json.contains("loaded_map")) {
    const auto localized =
        json["loaded_map"].value("frames_by_component", nlohmann::json::object());
    for (const auto& [component, frames] : localized.items())
      row[7] += fmt::format("{}component {}: {}", row[7].empty() ? "" : ", ", component,
                            frames.get<int>());
  }
  for (const auto& finding : json.at("findings")) {
    if (finding.at("severity") == "untrusted")
      row[6] += (row[6].empty() ? "" : " ") + finding.at("code").get<std::string>();
  }
  return row;
}

std::string csv_of(const std::vector<Row>& rows) {
  std::string text;
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      const bool quoted = row[i].find_first_of(",\"\n") != std::string::npos;
      std::string value = row[i];
      for (std::size_t at = 0; quoted && (at = value.find('"', at)) != std::string::npos; at += 2)
        value.insert(at, 1, '"');
      text += (i > 0 ? "," : "") + (quoted ? '"' + value + '"' : value);
    }
    text += '\n';
  }
  return text;
}

/// Throws Error if the table would replace what no batch wrote.
void require_own_table(const fs::path& table, bool force) {
  if (force || !is_file(table) || read_file(table).starts_with(csv_of({kColumns}))) return;
  throw Error("is not a table of a batch, or was changed", table.string(),
              "move it to another folder, or add --force");
}

/// Returns a relative address. https://www.rfc-editor.org/rfc/rfc3986#section-2
std::string address_of(const std::string& file) {
  std::string address;
  for (const char c : file) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || std::strchr("-._~/", c);
    address += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return address;
}

/// Returns the report of a job, or what it printed if it failed.
std::string page_link(const Row& row) {
  const bool failed = row[1] == status_of(kFailure);
  return address_of(failed ? "jobs/" + row.back() + ".log" : row.back() + "/report.html");
}

std::string page_of(const std::vector<Row>& rows) {
  std::string table = "<div class=\"scroll\"><table>\n";
  for (const Row& row : rows) {
    const bool is_head = &row == &rows.front();
    table += "<tr>";
    for (std::size_t i = 0; i + 1 < row.size(); ++i) {
      std::string cell = escape_markup(row[i]);
      if (i == 0 && !is_head) cell = fmt::format("<a href=\"{}\">{}</a>", page_link(row), cell);
      table += is_head ? "<th>" + cell + "</th>" : "<td>" + cell + "</td>";
    }
    table += "</tr>\n";
  }
  return html_page("Batch", html_card("Recordings", table + "</table></div>\n"), "");
}

/// Writes the table of all jobs, and prints it. Returns the exit code.
int write_table(const Batch& batch, const std::vector<Job>& jobs, const std::vector<JobEnd>& ends) {
  std::vector<Row> rows{kColumns};
  std::size_t width = kColumns[0].size();
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    rows.push_back(row_of(batch, jobs[i], ends[i]));
    width = std::max(width, rows.back().back().size());
  }
  ResultFolder folder(batch.out());
  folder.write_text(kTable, csv_of(rows));
  folder.write_text("results.html", page_of(rows));
  folder.require_all();
  for (const Row& row : rows) {
    const bool head = &row == &rows.front();
    print_out("{:<{}}  {:<12} {:>7} {:>11} {:>8} {:>8}  {}{}\n", head ? row[0] : row.back(), width,
              row[1], row[2], row[3], row[4], row[5], row[6],
              head || row[7].empty() ? "" : "localized in " + row[7]);
  }
  int code = kSuccess;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    if (ends[i].code == kSuccess) continue;
    if (ends[i].code != kDoubtful && ends[i].code != kInterrupted)
      print_error("stillmap: {}: exit code {}\n  see {}\n", jobs[i].name, ends[i].code,
                  batch.file_of(jobs[i], ".log").string());
    code = ends[i].code == kDoubtful && code != kFailure ? kDoubtful : kFailure;
  }
  print_out("{}", open_line(batch.out() / "results.html"));
  return interrupted() ? kInterrupted : code;
}

/// Merges the maps of the jobs that have one.
int merge_maps_of(const Batch& batch, const std::vector<Job>& jobs, const std::string& file) {
  std::vector<std::string> words{program().string(), "map", "merge"};
  std::map<std::uint64_t, std::string> known;  // names of the maps by their content
  for (const Job& job : jobs) {
    const fs::path map = batch.results_of(job) / kRunMap;
    if (!is_file(map)) continue;
    const auto [same, added] = known.emplace(with_content(map, fnv1a("")), job.name);
    if (added)
      words.push_back(map.string());
    else
      print_out("{} is not merged: its map is that of {}\n", job.name, same->second);
  }
  constexpr std::size_t kCommand = 3;
  if (words.size() < kCommand + 2) {
    print_error("stillmap: {}: not written, since there {}\n", file,
                words.size() == kCommand ? "is no map" : "is one map only");
    return kFailure;
  }
  words.insert(words.end(), {"--out", fs::absolute(file).string(), "--force"});
  const fs::path log = batch.out() / "jobs" / "merge.log";
  const int code = run_program(words, log);
  print_out("{}", read_file(log));
  return code;
}

// ---- Slurm

/// Returns a word as the shell reads it.
std::string quoted(const std::string& word) {
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

/// Returns a path as sbatch reads it, which replaces patterns such as %j.
std::string without_patterns(const std::string& path) {
  std::string text;
  for (const char c : path) text += c == '%' ? std::string("%%") : std::string(1, c);
  return text;
}

/// Writes the scripts of the job array, of the job that follows it, and of their submission, and
/// runs the latter. https://slurm.schedmd.com/sbatch.html
int submit(const BatchArguments& arguments, const Batch& batch, const std::vector<Job>& jobs,
           const std::vector<std::string>& options) {
  std::string command = quoted(program().string()) + " batch";
  for (const Job& job : jobs) command += " " + quoted(fs::absolute(job.recording).string());
  command += " --out " + quoted(batch.out().string());
  for (const std::string& word : options) command += " " + quoted(word);
  const std::string folder = (batch.out() / "jobs").string();
  const auto script = [&](const std::string& name, const std::string& last) {
    return fmt::format(
        "#!/bin/sh\n#SBATCH --job-name={} --requeue\n#SBATCH --output=\"{}/{}\"\ncd {}\nexec {} "
        "{}\n",
        name, without_patterns(folder), name == "stillmap" ? "slurm_%a.txt" : "slurm_results.txt",
        quoted(fs::current_path().string()), command, last);
  };
  const std::string merge =
      arguments.merge.empty() ? "" : "--merge " + quoted(fs::absolute(arguments.merge).string());
  const std::map<std::string, std::string> scripts{
      {"array.sh", script("stillmap", "--only $SLURM_ARRAY_TASK_ID")},
      {"results.sh", script("stillmap-results", merge)},
      {"submit.sh", fmt::format("#!/bin/sh\nset -e\n"
                                "array=$(sbatch --parsable --array=0-{} {} {}/array.sh)\n"
                                "sbatch --dependency=afterany:$array {} {}/results.sh\n",
                                jobs.size() - 1, arguments.slurm, quoted(folder), arguments.slurm,
                                quoted(folder))}};
  for (const auto& [name, text] : scripts) {
    if (arguments.dry_run) print_out("==> {}/{} <==\n{}\n", folder, name, text);
    write_file(fs::path(folder) / name, text);
  }
  if (arguments.dry_run) return kSuccess;
  const fs::path log = fs::path(folder) / "submit.log";
  const int code = run_program({"/bin/sh", folder + "/submit.sh"}, log);
  print_out("{}", read_file(log));
  if (code != 0)
    throw Error("the jobs were not submitted", log.string(),
                "install slurm-client, or check the options of --slurm");
  print_out("when the jobs have ended: {}\n", (batch.out() / "results.html").string());
  return kSuccess;
}

/// Prints what would be run. Returns the exit code.
int show(const Batch& batch, const std::vector<Job>& jobs) {
  int code = kSuccess;
  for (const Job& job : jobs) {
    print_out("{} -> {}\n", job.recording, batch.results_of(job).string());
    if (fs::exists(job.recording)) continue;
    print_error("stillmap: {}: does not exist\n  fix: check its name\n", job.recording);
    code = kFailure;
  }
  return code;
}

int run_batch(const BatchArguments& arguments, const CLI::App& command) {
  const std::vector<Job> jobs = jobs_of(arguments);
  const std::vector<std::string> options = run_words(command);
  options_of(arguments);  // Throws Error for options that no job could use.
  for (const std::string& file : {arguments.model, arguments.load_map, arguments.zones}) {
    if (!file.empty() && !fs::exists(file)) throw Error("does not exist", file, "check its name");
  }
  if (arguments.localize_only && !arguments.merge.empty())
    throw Error("runs that only localize have no maps of their own", "--merge",
                "leave out --merge or --localize-only");
  if (!arguments.merge.empty()) require_replaceable(arguments.merge, is_saved_map, arguments.force);
  require_outside(jobs, absolute_path(arguments.out));
  const Batch batch(arguments, options);
  require_own_table(batch.out() / kTable, arguments.force);
  for (const Job& job : jobs) batch.require_own(job);
  if (arguments.use_slurm) return submit(arguments, batch, jobs, options);
  if (arguments.dry_run) return show(batch, jobs);
  catch_interrupt();
  if (arguments.only) {
    if (static_cast<std::size_t>(*arguments.only) >= jobs.size())
      throw Error(fmt::format("there are {} jobs", jobs.size()), "--only", "count from 0");
    return batch.run(jobs[static_cast<std::size_t>(*arguments.only)]).code;
  }
  const int code = write_table(batch, jobs, run_all(batch, jobs, arguments.jobs));
  if (arguments.merge.empty() || interrupted()) return code;
  return std::max(code, merge_maps_of(batch, jobs, arguments.merge));
}

}  // namespace

void add_batch_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<BatchArguments>();
  CLI::App* command =
      app.add_subcommand("batch", "map many recordings, each into a folder of its own");
  command->add_option("recordings", arguments->recordings,
                      "recordings, as of stillmap run, or quoted patterns of their names");
  command->add_option("--list", arguments->list,
                      "text file with one recording or pattern per line");
  command->add_option("--out", arguments->out, "folder for all results")->required();
  command
      ->add_option("--jobs", arguments->jobs,
                   "number of recordings that are mapped at the same time")
      ->check(CLI::PositiveNumber);
  command->add_option("--merge", arguments->merge,
                      "merge the maps of all recordings into this file");
  command
      ->add_option(
          "--slurm", arguments->slurm,
          "run the recordings as a job array of Slurm, and table and merge as a job after it, with "
          "these options of sbatch")
      ->expected(0, 1)
      ->type_name("OPTIONS");
  command->add_flag("--dry-run", arguments->dry_run,
                    "print what would be run, with --slurm the scripts");
  command->add_option("--only", arguments->only, "number of the only job that is run")->group("");
  add_quiet_option(*command);
  add_recording_options(*command, *arguments);
  add_method_options(*command, *arguments);
  add_result_options(*command, *arguments);
  add_start_options(*command, *arguments);
  command->footer(
      "A recording is mapped again only if its content, the options or the program changed, or if "
      "it failed.\n"
      "Examples:\n"
      "  stillmap batch 'recordings/*' --out results --jobs 2\n"
      "  stillmap batch --list monday.txt --out monday --merge monday.map --model "
      "yolo11n-seg.onnx\n"
      "  stillmap batch 'tuesday/*.mcap' --out tuesday --load-map monday.map --localize-only\n"
      "  stillmap batch 'recordings/*' --out results --slurm='--partition=cpu --cpus-per-task=2'\n"
      "Files:\n"
      "  results.csv, results.html  table of all recordings\n"
      "  NAME/                      results of a recording, as of stillmap run\n"
      "  jobs/                      what each job printed, and how it ended");
  command->callback([arguments, command, &exit_code] {
    arguments->use_slurm = command->count("--slurm") > 0;
    exit_code = run_batch(*arguments, *command);
  });
}

}  // namespace stillmap

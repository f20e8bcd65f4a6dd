# SPDX-License-Identifier: Apache-2.0
"""The tables of the four papers (published_figures.json) beside the figures of runs.

A run is a dictionary: `preset` (a preset, a variant or another system), `sequence`, `first_frame`, and either `problem` or
the figures of `stillmap eval` with those that `lab reproduce` adds from summary.json; times are missing for other systems.
"""
import json
import statistics
from dataclasses import dataclass, field
from pathlib import Path

from lab.core import in_order, leaf

BASELINE, OWN = "orb-rgbd", "fused"  # in place of the papers' baselines, and our own system
PAPERS = {paper["preset"]: paper for paper in json.loads(
    (Path(__file__).parent / "published_figures.json").read_text(encoding="utf-8"))["papers"]}

# Measure of a paper's table: its title, the decimals that the papers print, and its place among the figures of a run.
MEASURES = {
    "ate": ("ATE [m]", 4, ("ate", "translation_m")),
    "rpe_frame_translation": ("RPE from frame to frame, translation [m]", 4, ("rpe_frame", "translation_m")),
    "rpe_frame_rotation": ("RPE from frame to frame, rotation [deg]", 4, ("rpe_frame", "rotation_deg")),
    "rpe_second_translation": ("RPE over one second, translation [m]", 4, ("rpe_1s", "translation_m")),
    "tracking_time": ("tracking time per frame [ms]", 2, ("tracking_ms",)),
    "ate_improvement": ("improvement of the ATE RMSE over the baseline [%]", 2, ("ate", "translation_m"))}
ATE = ("ate", "translation_m", "rmse")
# Figures of a run: title, decimals, factor, place.
ERRORS = {
    "rpe_1s": ("RPE RMSE over 1 s [mm]", 1, 1000, ("rpe_1s", "translation_m", "rmse")),
    "rpe_frame": ("RPE RMSE from frame to frame [mm]", 1, 1000, ("rpe_frame", "translation_m", "rmse"))}
COSTS = {
    "tracking": ("tracking [ms]", 1, 1, ("tracking_ms", "mean")),
    "with_network": ("tracking with the detector [ms]", 1, 1, ("with_detector_ms", "mean")),
    "total": ("whole system [ms]", 1, 1, ("total_ms", "mean")),
    "tracked": ("frames tracked [%]", 1, 100, ("coverage", "share")),
    "dynamic": ("highly dynamic frames [%]", 1, 100, ("highly_dynamic",)),
    "map_points": ("points of the dense map", 0, 1, ("ghosts", "points")),
    "ghosts": ("ghosts among them", 0, 1, ("ghosts", "ghosts")),
    "kept": ("static surface in the dense map [%]", 1, 100, ("ghosts", "surface_share"))}
CRANE = [
    ("closure in the plane [% of the path]", 3, 1, ("closure", "plane_percent")),
    ("closure in space [m]", 4, 1, ("closure", "space_m")), ("ATE RMSE [m]", 4, 1, ATE), COSTS["tracked"], COSTS["tracking"],
    ("points of the map", 0, 1, ("ghosts", "points")), ("ghosts", 0, 1, ("ghosts", "ghosts"))]
COST_NOTE = ("Tracking: the thread of the camera, without and with waiting for the network. Whole system: the time of a run "
             "divided by its frames, with network, mapping and the final steps.")
STATISTICS = {"rmse": "RMSE", "sd": "SD", "mean": "mean", "median": "median"}  # names in tables
WALKING = ("walking_", "kitchen_walking_")  # beginnings of the names of sequences in which people walk
NO_ERROR = 1e-9  # m; a baseline with less is the truth itself
NEARLY_ALL = 0.95  # share of the frames; a note tells of runs with fewer

# ------------------------------------------------------------------------------------------------------- cells


def rounded(value, decimals):
    """Returns a number as text, ties away from zero: 83.355, which no binary number is, becomes 83.36."""
    return f"{value * (1 + 1e-12):.{decimals}f}"


@dataclass(frozen=True)
class Figure:
    """A number in a table, shown with the runs of which it is the mean. None is shown as a dash."""
    value: float | None
    decimals: int = 0
    runs: tuple = ()

    def __str__(self):
        if self.value is None:
            return "-"
        text = rounded(self.value, self.decimals)
        return f"{text} ({' '.join(rounded(run, self.decimals) for run in self.runs)})" if len(self.runs) > 1 else text


def has_value(cell):
    return isinstance(cell, Figure) and cell.value is not None


def in_latex(text):
    words = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
    return "".join(words.get(c, "\\" + c if c in "%_&#${}" else c) for c in str(text))


@dataclass
class Table:
    """Rows of texts and figures, with a title above and notes below."""
    title: str
    columns: list
    rows: list = field(default_factory=list)
    notes: list = field(default_factory=list)

    def numeric(self):
        """Returns whether each column has numbers, which are aligned to the right."""
        return [any(has_value(row[i]) for row in self.rows) for i in range(len(self.columns))]

    def markdown(self):
        """Returns the table in Markdown, with aligned columns, so that it is also readable as text."""
        lines = [[str(cell).replace("|", "\\|") for cell in row] for row in [self.columns, *self.rows]]
        widths = [max(map(len, column)) for column in zip(*lines)]
        numeric = self.numeric()

        def text(line, is_head=False):
            return "|" + "".join(f" {cell:{'>' if right and not is_head else '<'}{width}} |"
                                 for cell, width, right in zip(line, widths, numeric)) + "\n"
        rule = "|" + "".join("-" * (width + 1) + (":|" if right else "-|") for width, right in zip(widths, numeric)) + "\n"
        return (f"**{self.title}**\n\n" + text(lines[0], True) + rule + "".join(map(text, lines[1:]))
                + "".join(f"\n{note}\n" for note in self.notes))

    def latex(self):
        """Returns the table as a LaTeX float, for which no package is needed."""
        lines = [" & ".join(map(in_latex, row)) + " \\\\\n" for row in [self.columns, *self.rows]]
        alignment = "".join("r" if right else "l" for right in self.numeric())
        return (f"\\begin{{table}}\n\\caption{{{in_latex(self.title)}}}\n\\begin{{tabular}}{{{alignment}}}\n\\hline\n{lines[0]}"
                f"\\hline\n{''.join(lines[1:])}\\hline\n\\end{{tabular}}\n"
                + "".join(f"\n{in_latex(note)}\n" for note in self.notes) + "\\end{table}\n")

    def as_json(self):
        rows = [{name: cell.value if isinstance(cell, Figure) else cell for name, cell in zip(self.columns, row)}
                for row in self.rows]
        return {"title": self.title, "columns": self.columns, "notes": self.notes, "rows": rows}

    def without_empty_columns(self):
        """Returns the table without the columns that have no number, except the first one."""
        kept = [i == 0 or has for i, has in enumerate(self.numeric())]

        def chosen(line):
            return [cell for cell, keep in zip(line, kept) if keep]
        return Table(self.title, chosen(self.columns), list(map(chosen, self.rows)), self.notes)


# ------------------------------------------------------------------------------------------------------ figures


def values_of(runs, system, sequence, place, factor=1):
    """Returns a figure of all runs of a system on a sequence; empty if one of the runs lacks it, since a mean would then
    be one over other starts than the baseline's."""
    values = [leaf(run, *place) for run in runs if (run["preset"], run["sequence"]) == (system, sequence)]
    return [] if None in values else [factor * value for value in values]


def mean(values):
    return sum(values) / len(values) if values else None


def mean_figure(runs, system, sequence, figure):
    _, decimals, factor, place = figure
    return Figure(mean(values_of(runs, system, sequence, place, factor)), decimals)


def mean_of_cells(cells):
    """Returns the mean of figures; an empty one if one of them is."""
    return Figure(mean([cell.value for cell in cells]), cells[0].decimals) if all(map(has_value, cells)) else Figure(None)


def improvement(baseline, other):
    """Returns the improvement rate over the baseline [%], equation 4 of SLAM3-YOLOv8; None if a figure is missing."""
    return None if baseline is None or other is None or baseline < NO_ERROR else 100 * (baseline - other) / baseline


def published(table, sequence, system, statistic):
    """Returns a printed figure; None if the table does not have it."""
    values = table["rows"].get(sequence, {}).get(system)
    return values[table["statistics"].index(statistic)] if values else None


def sequences_of(runs, paper=None):
    """Returns the sequences of a paper, then all others that were run."""
    return in_order([*(paper["sequences"] if paper else []), *(run["sequence"] for run in runs)])


# ---------------------------------------------------------------------------------------------- tables of a paper


def systems_of(paper, others):
    return [BASELINE, paper["preset"], OWN, *others]


def columns_of(paper, table, runs, others, reference):
    """Returns the columns of a table: name, system, and the function that gives a cell from system, sequence and statistic."""
    _, decimals, place = MEASURES[table["measure"]]
    is_time, is_rate = table["measure"] == "tracking_time", table["measure"] == "ate_improvement"

    def measured(system, sequence, statistic):
        values = values_of(runs, system, sequence, (*place, statistic))
        return Figure(mean(values), decimals, () if is_time else tuple(values))

    def improved(system, *row):
        return Figure(improvement(measured(reference, *row).value, measured(system, *row).value), 2)

    def waiting(system, sequence, statistic):
        return Figure(mean(values_of(runs, system, sequence, ("with_detector_ms", statistic))), decimals)

    def printed(system, sequence, statistic):
        return Figure(published(table, sequence, system, statistic), decimals)

    def printed_rate(system, *row):
        return Figure(improvement(printed(paper["baseline"], *row).value, printed(system, *row).value), 2)

    columns = [] if is_rate else [(BASELINE, BASELINE, measured)]
    for system in systems_of(paper, others)[1:]:
        columns.append((system, system, improved if is_rate else measured))
        if is_time:  # improvement rates are for errors: a time depends on the computer and on what else it does
            columns.append((f"{system} with the detector", system, waiting))
        elif not is_rate:
            columns.append((f"{system} improved [%]", system, improved))
    columns += [(f"published: {system}", system, printed) for system in table["systems"]]
    if not is_time and not is_rate and {paper["baseline"], paper["system"]} <= set(table["systems"]):
        columns.append(("improved, from the published [%]", paper["system"], printed_rate))
    return columns


def means_of(rows, table):
    """Returns rows with the means that the abstracts report: of errors over the walking sequences, of times over all
    sequences of the paper. A mean is left empty if a sequence has no value."""
    groups = {f"{beginning}*": [row for row in rows if row[0].startswith(beginning)] for beginning in WALKING}
    if table["measure"] == "tracking_time":
        groups = {"the paper's sequences": [row for row in rows if row[0] in table["rows"]]}
    means = []
    for group, chosen in groups.items():
        for statistic in (STATISTICS[name] for name in table["statistics"]):
            cells = list(zip(*(row for row in chosen if row[1] == statistic)))
            if cells and len(cells[0]) > 1:
                means.append([f"mean of {group}", statistic, *map(mean_of_cells, cells[2:])])
    return means


def incomplete_runs(runs):
    """Returns a note for each run without a pose for many frames, which its error does not contain."""
    return [f"{run['preset']} has poses for {100 * run['coverage']['share']:.1f} % of the frames of {run['sequence']} "
            f"(run from frame {run['first_frame']}): its error is that of these frames only."
            for run in runs if "coverage" in run and run["coverage"]["share"] < NEARLY_ALL]


def paper_table(paper, table, runs, others, reference):
    """Returns one table of a paper: a row per sequence and statistic, then means."""
    columns = columns_of(paper, table, runs, others, reference)
    place = table["number"] if table["number"].startswith("section") else f"table {table['number']}"
    known = {*table["rows"], *(run["sequence"] for run in runs)}
    rows = [[sequence, STATISTICS[statistic], *(cell(system, sequence, statistic) for _, system, cell in columns)]
            for sequence in sequences_of(runs, paper) if sequence in known for statistic in table["statistics"]]
    means, notes = means_of(rows, table), [table["remark"]] if "remark" in table else []
    notes += ["Published means are those of the published figures."] if means else []
    notes += [] if table["measure"] == "tracking_time" else incomplete_runs(runs)
    return Table(f"{paper['preset']}, {place}: {MEASURES[table['measure']][0]}",
                 ["sequence", "statistic", *(name for name, *_ in columns)], rows + means, notes)


def cost_table(paper, runs, others):
    columns = [(f"{system}, {figure[0]}", system, figure) for figure in COSTS.values() for system in systems_of(paper, others)]
    rows = [[sequence, *(mean_figure(runs, system, sequence, figure) for _, system, figure in columns)]
            for sequence in sequences_of(runs, paper)]
    table = Table(f"{paper['preset']}: time per frame, and frames tracked", ["sequence", *(name for name, *_ in columns)],
                  [row for row in rows if any(map(has_value, row))], [COST_NOTE])
    return table.without_empty_columns()


def paper_tables(paper, runs, others=(), reference=BASELINE):
    """Returns the tables of a paper with the figures of the runs and the published ones, and one with times and tracked
    frames. Figures of several runs are averaged before the improvement rate over the reference is computed."""
    return [*(paper_table(paper, table, runs, others, reference) for table in paper["tables"]), cost_table(paper, runs, others)]


# ---------------------------------------------------------------------------------------- tables of all systems


def system_table(title, runs, cell):
    """Returns a table with a row per system and a column per sequence. Systems without a value are left out."""
    sequences = sequences_of(runs)
    rows = [[system, *(cell(system, sequence) for sequence in sequences)] for system in in_order(r["preset"] for r in runs)]
    return Table(title, ["system", *sequences], [row for row in rows if any(str(cell) != "-" for cell in row[1:])])


def add_walking_means(table):
    """Adds columns with the means over the walking sequences, if there are several."""
    for beginning in WALKING:
        walking = [i for i, name in enumerate(table.columns) if name.startswith(beginning)]
        if len(walking) > 1:
            table.columns.append(f"mean of {beginning}*")
            for row in table.rows:
                row.append(mean_of_cells([row[i] for i in walking]))


def summary_tables(runs, reference=BASELINE):
    """Returns tables by their keys: median and worst ATE, improvement rate of the mean ATE, RPE, times, tracked frames and,
    where known, highly dynamic frames and figures of the dense map."""
    def ate(system, sequence):
        values = values_of(runs, system, sequence, ATE, 1000)
        return Figure(mean(values), 1) if len(values) < 2 else f"{statistics.median(values):.1f}; {max(values):.1f}"

    def rate(system, sequence):
        compared = (mean(values_of(runs, name, sequence, ATE)) for name in (reference, system))
        return Figure(None if system == reference else improvement(*compared), 1)

    tables = {"ate": system_table("ATE RMSE [mm]", runs, ate),
              "improvement": system_table(f"ATE RMSE: improvement of the mean over {reference} [%]", runs, rate)}
    if any(isinstance(cell, str) for row in tables["ate"].rows for cell in row[1:]):
        tables["ate"].title += ": median; worst of the runs"
    add_walking_means(tables["improvement"])
    for key, figure in (ERRORS | COSTS).items():
        table = system_table(figure[0], runs, lambda *place, figure=figure: mean_figure(runs, *place, figure))
        if table.rows:
            tables[key] = table.without_empty_columns()
    return tables


def crane_table(paper, runs, reference=BASELINE):
    """Returns the closure errors of the crane's camera, means over the runs of a system on a sequence."""
    columns = ["sequence", "preset", "closure in the plane [m]", "improved [%]", *(title for title, *_ in CRANE)]
    table = Table(f"{paper['preset']}, section 4.5: closure error of a crane's camera", columns, notes=[paper["crane"]])
    for sequence, system in in_order((run["sequence"], run["preset"]) for run in runs):
        ours, theirs = (values_of(runs, name, sequence, ("closure", "plane_m")) for name in (system, reference))
        rate = None if system == reference else improvement(mean(theirs), mean(ours))
        table.rows.append([sequence, system, Figure(mean(ours), 4, tuple(ours)), Figure(rate, 2),
                           *(mean_figure(runs, system, sequence, figure) for figure in CRANE)])
    return table

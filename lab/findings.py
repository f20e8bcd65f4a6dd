# SPDX-License-Identifier: Apache-2.0
"""False alarms and misses of the findings of `stillmap run`, on pieces of good recordings and of wrong copies of them.

  python3 -m lab findings SEQUENCES --out DIR [--pieces 20,40,120] [--step 50] [--only NAMES]

SEQUENCES holds sequences in TUM layout with groundtruth.txt. Pieces of these lengths that begin every --step frames are
mapped by one preset without a dense map, and so are pieces of the greatest length of every wrong variant: a wrong depth
factor or focal length, late depth, shifted depth images (needs Pillow), and a late or inverted truth. A finding on a good
piece is a false alarm, unless it is a note about the truth: notes do not mark the result (exit code 3). Pieces of good
recordings whose ATE is above 5 cm are a column of their own: there a missing finding is a miss.

Written to DIR after each piece: findings.md (printed at the end) and findings.json, with every finding and its piece. A
piece that the same program mapped already is not repeated.
"""
import re
import shutil
import subprocess
from collections import Counter
from pathlib import Path

from lab import core

LATE = 1.0  # delay of late depth and truth [s]
SHIFT = 16  # of the depth images [pixels]
WRONG_RESULT = 0.05  # ATE of a piece of a good recording that is not right [m]


def add_arguments(parser):
    parser.add_argument("sequences", type=Path, help="folder of sequences in TUM layout, with groundtruth.txt")
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")
    parser.add_argument("--only", type=core.names, default=[], help="only sequences of these names")
    parser.add_argument("--pieces", type=lambda text: [int(n) for n in text.split(",")], default=[20, 40, 120],
                        help="lengths of the pieces [frames]; default: 20,40,120")
    parser.add_argument("--step", type=int, default=50, help="frames between pieces of one length; default: %(default)s")
    parser.add_argument("--wrong-step", type=int, default=200, help="the same for wrong pieces; default: %(default)s")
    parser.add_argument("--preset", default="static", help="default: %(default)s")
    parser.add_argument("--program", type=Path, default=core.PROGRAM, help="default: %(default)s")


# ------------------------------------------------------------------------------------------------ wrong recordings


def rows(file):
    return [line.split() for line in file.read_text(encoding="utf-8").splitlines() if line and line[0] != "#"]


def write_rows(file, lines):
    file.write_text("".join(" ".join(line) + "\n" for line in lines), encoding="utf-8")


def moved(lines, seconds):
    return [[f"{float(line[0]) + seconds:.6f}", *line[1:]] for line in lines]


def linked(sequence, folder):
    """Returns a folder with the files of a sequence: copies of the lists and the camera, links to the images."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for entry in sequence.iterdir():
        if entry.suffix in (".txt", ".yaml") and entry.name != "associations.txt":
            shutil.copy(entry, folder / entry.name)
        elif entry.name in ("rgb", "depth"):
            (folder / entry.name).symlink_to(entry.resolve())
    return folder


def camera_times(key, factor):
    def change(folder):
        file = folder / "camera.yaml"
        text, found = re.subn(rf"(?m)^({key}: *)([\d.]+)", lambda m: f"{m[1]}{float(m[2]) * factor:g}",
                              file.read_text(encoding="utf-8"))
        file.write_text(text, encoding="utf-8")
        return found > 0
    return change


def late(name):
    def change(folder):
        write_rows(folder / name, moved(rows(folder / name), LATE))
        return True
    return change


def inverted_truth(folder):
    def inverse(line):
        t, q = [float(x) for x in line[1:4]], [float(x) for x in line[4:8]]
        u, w = [-x for x in q[:3]], q[3]
        cross = lambda a, b: [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        s = [w * a + b for a, b in zip(t, cross(u, t))]
        turned = [a + 2 * b for a, b in zip(t, cross(u, s))]
        return [line[0], *(f"{-x:.6f}" for x in turned), *(f"{x:.6f}" for x in u), line[7]]
    write_rows(folder / "groundtruth.txt", [inverse(line) for line in rows(folder / "groundtruth.txt")])
    return True


def shifted_depth(folder):
    try:
        from PIL import Image
    except ImportError:
        return False
    images = (folder / "depth").resolve()
    (folder / "depth").unlink()
    (folder / "depth").mkdir()
    for file in images.glob("*.png"):
        with Image.open(file) as image:
            shifted = Image.new(image.mode, image.size)
            shifted.paste(image, (SHIFT, 0))
            shifted.save(folder / "depth" / file.name, compress_level=1)
    return True


WRONG = {"depth factor x 2": camera_times("depth_factor", 2), "depth factor x 0.2": camera_times("depth_factor", 0.2),
         "focal length x 1.4": camera_times("f[xy]", 1.4), f"depth {LATE:g} s late": late("depth.txt"),
         f"depth shifted by {SHIFT} pixels": shifted_depth, f"truth {LATE:g} s late": late("groundtruth.txt"),
         "truth inverted": inverted_truth}


# ------------------------------------------------------------------------------------------------------ measurement


def findings_of(arguments, sequence, first, count):
    """Returns the findings by which the result of a piece should not be trusted and those about the truth, severity by
    code, and its ATE [m]."""
    out = arguments.out / "run"
    command = core.run_command(arguments.program, sequence, out,
                               ["--first", first, "--count", count, "--preset", arguments.preset, "--force", "-q"],
                               settings=["dense.enabled=false"])
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in (0, core.UNTRUSTED):
        return {"failed": "error"}, None
    summary = core.read_json(out / "summary.json")
    findings = {f["code"]: f["severity"] for f in summary["findings"]
                if f["severity"] == "untrusted" or f["code"].startswith("truth-")}
    return findings, core.figures_of(summary)["ate_rmse_m"]


def pieces(sequence, lengths, step):
    frames = len(rows(sequence / "rgb.txt"))
    return [(first, count) for count in lengths for first in range(0, max(1, frames - count + 1), step)]


def measure(arguments, folder, variant, lengths, step, results):
    """Adds the findings of the pieces of a sequence to the results."""
    for first, count in pieces(folder, lengths, step):
        piece = {"program": arguments.version, "preset": arguments.preset, "sequence": folder.name, "variant": variant,
                 "first": first, "count": count}
        if not any(piece.items() <= result.items() for result in results):
            findings, ate = findings_of(arguments, folder, first, count)
            results.append({**piece, "findings": findings, "ate_m": ate})
            write(arguments, results)
    found = [bool(r["findings"]) for r in results if (r["sequence"], r["variant"]) == (folder.name, variant)]
    core.say(f"{folder.name}, {variant}: {sum(found)} of {len(found)} with findings")


def column_of(result):
    wrong = result["variant"] == "good" and (result["ate_m"] or 0) > WRONG_RESULT
    return f"good, ATE above {WRONG_RESULT:g} m" if wrong else result["variant"]


def table(results, head):
    variants = core.in_order(column_of(r) for r in results)
    total = Counter(column_of(r) for r in results)
    found = Counter((name, column_of(r)) for r in results for name in r["findings"])
    marked = Counter(column_of(r) for r in results if set(r["findings"].values()) - {"note"})
    lines = [[name, *(found[name, variant] for variant in variants)] for name in sorted({name for name, _ in found})]
    lines.append(["exit code 3", *(marked[variant] for variant in variants)])
    return core.markdown(["finding", *(f"{v}: {total[v]} pieces" for v in variants)], lines, head)


def write(arguments, results):
    text = table(results, f"pieces that end with each finding, preset {arguments.preset}")
    core.write_tables(arguments.out, text, results, "findings")
    return text


def main(arguments):
    arguments.out.mkdir(parents=True, exist_ok=True)
    arguments.version = core.sha256_of(arguments.program)
    sequences = core.sequences_of(arguments)
    made = core.read_json(arguments.out / "findings.json") or []
    results = [r for r in made if (r["program"], r["preset"]) == (arguments.version, arguments.preset)]
    for sequence in sequences:
        measure(arguments, sequence, "good", arguments.pieces, arguments.step, results)
    for variant, change in WRONG.items():
        for sequence in sequences:
            folder = linked(sequence, arguments.out / "wrong" / sequence.name)
            if change(folder):
                measure(arguments, folder, variant, [max(arguments.pieces)], arguments.wrong_step, results)
    shutil.rmtree(arguments.out / "wrong", ignore_errors=True)
    print(write(arguments, results))
    return 0

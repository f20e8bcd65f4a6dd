# SPDX-License-Identifier: Apache-2.0
"""Cost of the view: tracking time with readers, traffic and latency; frames per second of the page for large maps.

  python3 -m lab view SEQUENCE --out RESULTS_DIR [--model NETWORK.onnx] [--points 1,5,10] [--count 300] [--starts 200]

The sequence is mapped without a view and with `--view` and 0, 1 and 5 clients, which read everything as
fast as they can, as a browser on another computer does. Tracking times are those of the run's summary.json. Then
clouds of --points million points are shown in a headless Chromium, which turns the map: its WebGL runs in software.
With --starts only runs of 20 frames are started so many times, each shown by the same page from its start and read by two
clients, and those that do not end within five minutes are counted.

Written to RESULTS_DIR: view.md (printed at the end), view.json, and a folder per run.
"""
import json
import random
import statistics
import struct
import subprocess
import threading
import time
from pathlib import Path

from lab import browser, core

CLIENTS = (None, 0, 1, 5)  # None: without --view
SECONDS = 20  # time for which the page turns a map
START_FRAMES, START_LIMIT = 20, 300  # frames of a start, and the time within which it ends [s]


def add_arguments(parser):
    parser.add_argument("sequence", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--program", type=Path, default=core.ROOT / "build/release/stillmap")
    parser.add_argument("--model", type=Path)
    parser.add_argument("--schedule", choices=("realtime", "lockstep"), default="realtime", help="default: %(default)s")
    parser.add_argument("--count", type=int, default=300, help="frames per run; default: %(default)s")
    parser.add_argument("--points", default="1,5,10", help="million points of the clouds; empty: none; default: %(default)s")
    parser.add_argument("--starts", type=int, default=0, help="number of starts with a page connected; default: none")


class Reader(threading.Thread):
    """A client that reads all messages until the server ends."""

    def __init__(self, url):
        super().__init__(daemon=True)
        self.channel = browser.WebSocket(url.replace("http:", "ws:") + "data")
        self.bytes, self.latencies, self.start_time = 0, [], time.monotonic()
        self.start()

    def run(self):
        try:
            while True:
                message = self.channel.receive()
                self.bytes += len(message)
                self.seconds = time.monotonic() - self.start_time
                if isinstance(message, str) and '"wall"' in message:
                    self.latencies.append(1000 * time.time() - json.loads(message)["wall"])
        except (browser.Refused, OSError):
            self.channel.close()


def address_in(process):
    for line in process.stdout:
        if line.startswith("view: "):
            return line.split()[1]
    raise core.Failed("the program printed no address")


def started(arguments, out, count, words):
    """A run with these words."""
    words = [arguments.program, "run", arguments.sequence, "--schedule", arguments.schedule, "--count", count,
             "--out", out, "--force", *(["--model", arguments.model] if arguments.model else []), *words]
    return subprocess.Popen([str(w) for w in words], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)


def starts_that_hang(arguments):
    """The starts that do not end, by number."""
    hanging = []
    with browser.Browser(1280, 800) as chromium:
        page = chromium.page()
        for start in range(arguments.starts):
            process = started(arguments, arguments.out / "start", START_FRAMES, ["--view", 0])
            url = address_in(process)
            page.open(url)
            readers = [Reader(url), Reader(url)]
            try:
                process.communicate(timeout=START_LIMIT)
            except subprocess.TimeoutExpired:
                hanging.append(start)
                process.kill()
                process.communicate()
            for reader in readers:
                reader.join(10)
            core.say(f"start {start + 1}: {len(hanging)} hung")
    return hanging


def run_with(clients, arguments):
    """Figures of one run in realtime."""
    out = arguments.out / f"run_{'plain' if clients is None else clients}"
    process = started(arguments, out, arguments.count, [] if clients is None else ["--view", 0])
    readers = [Reader(url) for url in [address_in(process)] * clients] if clients is not None else []
    process.stdout.read()
    if process.wait() not in (0, 3):
        raise core.Failed(f"{out}: the run failed")
    for reader in readers:
        reader.join(10)
    summary = json.loads((out / "summary.json").read_text())
    tracking = core.stage_of(summary, "tracking")
    latencies = sorted(value for reader in readers for value in reader.latencies)
    return {"clients": "no view" if clients is None else clients, "median_ms": tracking.get("median_ms"), "p95_ms": tracking.get("p95_ms"),
            "dropped": summary["frames"]["dropped_late"],
            "kib_per_s": statistics.mean(r.bytes / r.seconds / 1024 for r in readers) if readers else None,
            "latency_median_ms": statistics.median(latencies) if latencies else None,
            "latency_p95_ms": latencies[int(0.95 * len(latencies))] if latencies else None}


def write_cloud(file, millions):
    """A cloud of walls and floors of rooms, 1 cm apart, in random order."""
    n = int(millions * 1e6)
    rng, side = random.Random(1), (n / 4e4) ** 0.5  # four surfaces of 10^4 points per square meter
    with open(file, "wb") as out:
        properties = [f"property float {name}" for name in "xyz"] + [f"property uchar {name}" for name in ("red", "green", "blue")]
        out.write("\n".join(["ply", "format binary_little_endian 1.0", f"element vertex {n}", *properties, "end_header", ""]).encode())
        for start in range(0, n, 100000):
            rows = bytearray()
            for i in range(start, min(n, start + 100000)):
                x, z, k = rng.uniform(-side, side), rng.uniform(0, 2 * side), i % 4
                y = 1.5 if k < 2 else rng.uniform(-1, 1.5)  # floor or wall
                wall = (2 * round(x / 2) if k == 2 else x, y, 2 * round(z / 2) if k == 3 else z)
                shade = int(128 + 60 * ((int(x) + int(z)) % 2))
                rows += struct.pack("<fffBBB", *wall, shade, shade, 200 - 40 * k)
            out.write(rows)


def page_with(millions, arguments):
    """Frames per second and memory of a page that turns a map."""
    file = arguments.out / f"cloud_{millions:g}M.ply"
    if not file.exists():
        write_cloud(file, millions)
    process = subprocess.Popen([arguments.program, "view", file, "--port", "0"], stdout=subprocess.PIPE, text=True)
    try:
        url = address_in(process)
        with browser.Browser(1280, 800) as chromium:
            start = time.monotonic()
            page = chromium.page(url)
            page.wait(f"stillmap.points >= {int(millions * 1e6 * 0.99)} && stillmap.renders > 1", 400)
            loaded = time.monotonic() - start
            page.run("stillmap.spin(true)")
            time.sleep(SECONDS)
            state = json.loads(page.run("JSON.stringify(Object.assign({}, stillmap, {timer: 0}))"))
            page.run("stillmap.spin(false)")
            start = time.monotonic()
            page.wait("stillmap.rests", 60)
            rested = time.monotonic() - start
            drawn_at_rest = page.run("stillmap.drawn")
            page.call("HeapProfiler.collectGarbage")
            heap = page.call("Runtime.getHeapUsage")
            page.screenshot(arguments.out / f"page_{millions:g}M.png")
    finally:
        process.terminate()
        process.wait()
        process.stdout.close()
    memory = (heap["usedSize"] + heap.get("backingStorageSize", 0)) / 2**20
    return {"points": f"{millions:g} M", "loaded_s": loaded, "fps": state["fps"], "drawn": state["drawn"],
            "sharpness": state["sharpness"], "drawn_at_rest": drawn_at_rest, "rested_s": rested, "memory_mib": memory,
            "received_mib": state["bytes"] / 2**20}


def main(arguments):
    arguments.out.mkdir(parents=True, exist_ok=True)
    if arguments.starts > 0:
        print(f"{len(starts_that_hang(arguments))} of {arguments.starts} starts with a page connected did not end")
        return 0
    runs = [run_with(clients, arguments) for clients in CLIENTS]
    pages = [page_with(float(m), arguments) for m in arguments.points.split(",") if m] if browser.find_browser() else []
    cell = core.cell
    head = ["clients", "tracking, median [ms]", "p95 [ms]", "frames dropped", "per client [KiB/s]", "latency, median [ms]", "p95 [ms]"]
    lines = [[str(r["clients"]), cell(r["median_ms"], 1), cell(r["p95_ms"], 1), str(r["dropped"]), cell(r["kib_per_s"], 0),
              cell(r["latency_median_ms"], 1), cell(r["latency_p95_ms"], 1)] for r in runs]
    text = core.markdown(head, lines, "Effect on tracking")
    head = ["points", "loaded after [s]", "frames per second", "points drawn", "share of the pixels along a side",
            "points at rest", "at rest after [s]", "memory of the page [MiB]", "received [MiB]"]
    lines = [[p["points"], cell(p["loaded_s"], 1), cell(p["fps"], 1), str(p["drawn"]), cell(p["sharpness"], 2),
              str(p["drawn_at_rest"]), cell(p["rested_s"], 1), cell(p["memory_mib"], 0), cell(p["received_mib"], 0)] for p in pages]
    text += "\n" + core.markdown(head, lines, "The page, with WebGL in software")
    (arguments.out / "view.md").write_text(text)
    (arguments.out / "view.json").write_text(json.dumps({"runs": runs, "pages": pages}, indent=1))
    print(text)
    return 0

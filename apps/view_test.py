#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The page of the view in a headless Chromium, and its server; without a Chromium the tests of the page are skipped.

  apps/view_test.py PROGRAM     PROGRAM: the built command
"""
import http.client
import itertools
import json
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from lab.browser import Browser, Refused, WebSocket, find_browser

PROGRAM = ""
FRAMES = 150
STATE = "JSON.stringify(Object.assign({}, window.stillmap))"


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


class Viewed:
    """A `stillmap` that serves a page."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen([PROGRAM, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                        text=True)
        self.lines = []
        while not self.lines or not self.lines[-1].startswith("view: "):
            line = self.process.stdout.readline()
            if not line:
                raise AssertionError("no view: " + "".join(self.lines))
            self.lines.append(line)
        self.url = self.lines[-1].split()[1]
        self.port = int(self.url.split(":")[2].split("/")[0])

    def wait(self):
        text = self.process.communicate(timeout=300)[0]
        assert self.process.returncode in (0, 3), text
        return text

    def end(self):
        if self.process.poll() is None:
            self.process.terminate()
            self.process.wait(60)
        self.process.stdout.close()


class ViewTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name)
        cls.sequence = cls.folder / "sequence"
        scene = ["--fps", "10", "--width", "320", "--height", "240", "--people", "2", "--camera", "xyz"]
        subprocess.run([PROGRAM, "simulate", "--frames", str(FRAMES), *scene, "--out", cls.sequence], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        cls.masks = ("--masks", cls.sequence / "mask")

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    @classmethod
    def finished_run(cls):
        """A run with warnings and files for planners. Its floor is given, since few frames show it."""
        run = cls.folder / "finished"
        if not run.exists():
            rules = cls.folder / "finished.yaml"
            rules.write_text("zones: [{name: gate, polygon: [[-1, 1, 1], [1, 1, 1], [1, 1, 3]]}]\ndistances: [{to: camera, nearer: 30}]\n")
            subprocess.run([PROGRAM, "run", cls.sequence, *cls.masks, "--count", "60", "--zones", rules, "--planner", "--up", "0,-1,0",
                            "--camera-height", "1.4", "--out", run], check=False, stdout=subprocess.DEVNULL)
        return run

    def view(self, *arguments):
        viewed = Viewed(*arguments)
        self.addCleanup(viewed.end)
        return viewed

    def live(self, name, port=0, more=()):
        """A run at the speed of the camera: ten frames per second."""
        return self.view("run", self.sequence, *self.masks, "--schedule", "realtime", "--view", port,
                         "--out", self.folder / name, *more)


class Server(ViewTest):
    def get(self, viewed, path="/", method="GET", **headers):
        connection = http.client.HTTPConnection("127.0.0.1", viewed.port, timeout=30)
        connection.request(method, path, headers=headers)
        answer = connection.getresponse()
        body = answer.read()
        connection.close()
        return answer, body

    def test_serves_the_page_and_nothing_else(self):
        viewed = self.live("server")
        answer, body = self.get(viewed)
        self.assertEqual(answer.status, 200)
        self.assertIn(b"<title>Stillmap</title>", body)
        self.assertIn("default-src 'self'", answer.getheader("Content-Security-Policy"))
        for path in ("/main.js", "/warnings.js", "/view.css", "/three.min.js", "/OrbitControls.js", "/icon.svg"):
            self.assertEqual(self.get(viewed, path)[0].status, 200, path)
        self.assertEqual(self.get(viewed, "/image?t=0")[0].status, 404, "a run in progress sends its images")
        for path in ("/../README.md", "/etc/passwd", "/main.js/x", "/package.json", "/page_test.js", "//etc/passwd", "/%2e%2e/README.md"):
            self.assertIn(self.get(viewed, path)[0].status, (400, 403, 404), path)
        for method in ("POST", "PUT", "DELETE"):
            self.assertGreaterEqual(self.get(viewed, "/", method)[0].status, 400, method)
        self.assertEqual(self.get(viewed, Host="evil.example")[0].status, 403)

    def test_gives_data_to_its_own_page_only(self):
        viewed = self.live("origin")
        url = f"ws://127.0.0.1:{viewed.port}/data"
        own = WebSocket(url, {"Origin": f"http://127.0.0.1:{viewed.port}"})
        self.assertEqual(json.loads(own.receive())["type"], "run")
        own.close()
        for headers in ({"Origin": "http://evil.example"}, {"Origin": "null"}, {"Host": "evil.example"}):
            with self.assertRaises(Refused, msg=headers):
                WebSocket(url, headers).receive()

    def test_others_need_the_token(self):
        viewed = self.live("token", more=("--view-address", "0.0.0.0"))
        token = viewed.url.split("token=")[1]
        self.assertNotIn("0.0.0.0", viewed.url, "addresses that other computers can open are printed")
        self.assertEqual(self.get(viewed, "/access?token=" + token)[0].status, 200)
        answer, why = self.get(viewed, "/access")
        self.assertEqual((answer.status, b"token" in why), (403, True))
        url = f"ws://127.0.0.1:{viewed.port}/data"
        client = WebSocket(f"{url}?token={token}")
        self.assertEqual(json.loads(client.receive())["type"], "run")
        client.close()
        for wrong in ("", "?token=", "?token=" + token[:-1], "?token=" + "0" * len(token)):
            with self.assertRaises(Refused, msg=wrong):
                WebSocket(url + wrong).receive()

    def test_clients_that_read_nothing_lose_no_frame_of_the_run(self):
        viewed = self.live("stalled")
        stalled = [WebSocket(f"ws://127.0.0.1:{viewed.port}/data") for _ in range(5)]
        reader = WebSocket(f"ws://127.0.0.1:{viewed.port}/data")
        newest = -1
        while newest < FRAMES - 20:  # another client still gets the newest frames
            message = reader.receive()
            if isinstance(message, str) and (frame := json.loads(message))["type"] == "frame":
                newest = frame["index"]
        viewed.wait()
        for client in (*stalled, reader):
            client.close()
        frames = json.loads((self.folder / "stalled/summary.json").read_text())["frames"]
        self.assertEqual(frames["handed_in"] + frames["dropped_late"], FRAMES)

    def test_a_port_in_use_is_an_error_with_a_fix(self):
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            result = subprocess.run([PROGRAM, "run", self.sequence, "--view", str(taken.getsockname()[1]), "--out", self.folder / "taken"],
                                    capture_output=True, text=True, check=False)
        self.assertEqual(result.returncode, 1)
        self.assertIn("--view 0", result.stderr)

    def test_errors_name_the_option_of_the_command(self):
        def error(*arguments):
            result = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, check=False)
            self.assertEqual(result.returncode, 1, result.stderr)
            return result.stderr
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            for text in (error("view", self.sequence, "--port", 70000), error("view", self.sequence, "--port", taken.getsockname()[1])):
                self.assertIn("--port", text)
                self.assertNotIn("--view", text)
        self.assertIn("IPv4", error("view", self.sequence, "--port", 0, "--view-address", "::"))
        self.assertIn("no address of this computer", error("view", self.sequence, "--port", 0, "--view-address", "192.0.2.1"))

    def test_lockstep_results_are_the_same_with_a_view(self):
        def results(name, *more):
            command = [PROGRAM, "run", self.sequence, *self.masks, "--count", "60", "--out", self.folder / name, *more]
            viewed = self.view(*command[1:]) if more else subprocess.run(command, check=False, stdout=subprocess.DEVNULL)
            if more:
                client = WebSocket(f"ws://127.0.0.1:{viewed.port}/data")
                client.receive()
                viewed.wait()
                client.close()
            files = ("trajectory.txt", "keyframes.txt", "cloud.ply", "movers.csv")
            return {file: (self.folder / name / file).read_bytes() for file in files}
        self.assertEqual(results("plain"), results("viewed", "--view", "0"))

    def messages(self, viewed, last="images"):
        """The JSON messages of a finished run by type, up to one type."""
        client, messages = WebSocket(f"ws://127.0.0.1:{viewed.port}/data"), {}
        while last not in messages:
            message = client.receive()
            if isinstance(message, str):
                message = json.loads(message)
                messages[message["type"]] = message
        client.close()
        return messages

    def test_a_finished_run_gives_the_images_of_its_recording(self):
        run = self.finished_run()
        viewed = self.view("view", run, "--port", "0")
        messages = self.messages(viewed)
        self.assertEqual(messages["images"]["problem"], "")
        self.assertEqual((messages["run"]["camera"]["width"], messages["run"]["camera"]["height"]), (320, 240))
        times = [float(line.split()[0]) for line in (run / "trajectory.txt").read_text().splitlines() if not line.startswith("#")]
        images = [self.get(viewed, f"/image?t={t}") for t in (times[0], times[-1], times[0] + 0.01)]
        for answer, body in images:
            self.assertEqual((answer.status, answer.getheader("Content-Type"), body[:2]), (200, "image/jpeg", b"\xff\xd8"))
        self.assertEqual(images[0][1], images[2][1], "the image nearest to the time")
        self.assertNotEqual(images[0][1], images[1][1])
        for query in ("", "?t=", "?t=x", "?t=nan", "?t=1e9"):
            answer, why = self.get(viewed, "/image" + query)
            self.assertEqual((answer.status, why[:8]), (404, b"No image"), query)

    def test_images_need_the_token_and_tell_why_there_are_none(self):
        run = self.folder / "moved"
        shutil.copytree(self.finished_run(), run)
        summary = json.loads((run / "summary.json").read_text())
        summary["recording"] = str(self.folder / "gone")
        (run / "summary.json").write_text(json.dumps(summary))
        viewed = self.view("view", run, "--port", "0")
        self.assertIn("gone is not there any more", self.messages(viewed)["images"]["problem"])
        self.assertIn(b"not there any more", self.get(viewed, "/image?t=0")[1])
        viewed = self.view("view", self.finished_run(), "--port", "0", "--view-address", "0.0.0.0")
        token = viewed.url.split("token=")[1]
        self.assertEqual(self.get(viewed, "/image?t=0")[0].status, 403)
        self.assertEqual(self.get(viewed, "/image?t=0&token=" + token)[0].status, 200)

    def test_a_finished_run_gives_floor_grid_and_obstacles(self):
        run = self.finished_run()
        planner = self.messages(self.view("view", run, "--port", "0"))["planner"]
        obstacles = json.loads((run / "obstacles.json").read_text())
        self.assertEqual(planner["obstacles"], obstacles["obstacles"])
        self.assertEqual(planner["T_map_world"], obstacles["T_map_world"])
        size, pixels = (run / "grid.pgm").read_bytes().split(b"\n", 3)[1::2]
        grid, kinds = planner["grid"], {0: 2, 254: 1, 205: 0}
        self.assertEqual([grid["width"], grid["height"]], [int(side) for side in size.split()])
        cells = [value for value, count in zip(grid["cells"][::2], grid["cells"][1::2], strict=True) for _ in range(count)]
        self.assertEqual(cells, [kinds[pixel] for pixel in pixels])
        self.assertIn(f"resolution: {grid['resolution']:g}", (run / "grid.yaml").read_text())

    def test_warnings_have_the_numbers_of_the_map(self):
        messages = self.messages(self.view("view", self.finished_run(), "--port", "0"))
        tracks = {track["id"] for track in messages["tracks"]["tracks"]}
        events = [event for event in messages["events"]["events"] if event["kind"] in ("zone", "near")]
        self.assertTrue(any(event["mover"] > 0 for event in events))
        for event in events:
            number = re.search(r"(?:person|object) (\d*)", event["text"])[1]
            self.assertEqual(number, str(event["mover"]) if event["mover"] > 0 else "", event)
            self.assertTrue(event["mover"] in tracks or event["mover"] < 0, event)

    def test_the_summary_has_what_the_time_line_shows(self):
        run = self.folder / "gated"
        subprocess.run([PROGRAM, "run", self.sequence, *self.masks, "--count", "40", "--preset", "gated-seg", "--out", run], check=False,
                       stdout=subprocess.DEVNULL)
        summary = self.messages(self.view("view", run, "--port", "0"))["summary"]["summary"]
        self.assertIsInstance(summary["findings"], list)
        self.assertIsInstance(summary["frames"]["uncertain_at"], list)
        for begin, end in summary["frames"]["highly_dynamic_periods"]:
            self.assertLessEqual(begin, end)
        self.assertEqual(bool(summary["frames"]["highly_dynamic"]), bool(summary["frames"]["highly_dynamic_periods"]))

    def test_a_page_in_one_file_needs_nothing_else(self):
        page = self.folder / "page.html"
        for again in (False, True):
            result = subprocess.run([PROGRAM, "view", self.finished_run(), "--html", page], capture_output=True, text=True, check=False)
            self.assertEqual(result.returncode, 0, result.stderr)
        text = page.read_text()
        self.assertEqual(re.findall(r"""(?:src|href)=["'](?!data:)[^"']*""", text.split("<script>")[0]), [])
        self.assertNotIn("from './", text)
        other = self.folder / "other.html"
        other.write_text("<p>mine</p>")
        result = subprocess.run([PROGRAM, "view", self.finished_run(), "--html", other], capture_output=True, text=True, check=False)
        self.assertEqual((result.returncode, other.read_text()), (1, "<p>mine</p>"))
        self.assertIn("--force", result.stderr)


@unittest.skipUnless(find_browser(), "skipped: there is no Chromium")
class InTheBrowser(ViewTest):
    def setUp(self):
        self.browser = Browser(960, 640)
        self.addCleanup(self.browser.__exit__)

    def state(self, page):
        return json.loads(page.run(STATE))

    def boxes(self, page, selector):
        """Left, top, right and bottom of the visible elements [pixels]."""
        return page.run(f"[...document.querySelectorAll('{selector}')].map((e) => e.getBoundingClientRect())"
                        ".filter((r) => r.width > 0).map((r) => [r.left, r.top, r.right, r.bottom])")

    def assert_apart(self, boxes):
        for a, b in itertools.combinations(boxes, 2):
            self.assertFalse(a[0] < b[2] - 1 and b[0] < a[2] - 1 and a[1] < b[3] - 1 and b[1] < a[3] - 1, (a, b))

    @classmethod
    def crowded_run(cls):
        """A run with more warnings at once than there are banners."""
        run = cls.folder / "crowded"
        if not run.exists():
            rules = cls.folder / "crowded.yaml"
            zones = [f"{{name: a long name of zone {i}, polygon: [[-9, 3, -9], [9, 3, -9], [9, 3, 9], [-9, 3, 9]], height: [-9, 9]}}" for i in range(8)]
            rules.write_text(f"zones: [{', '.join(zones)}]\npoints: [{{name: hook, offset: [0, 0, 2]}}]\n"
                             "distances: [{to: hook, nearer: 2, level: true}]\n")
            subprocess.run([PROGRAM, "run", cls.sequence, *cls.masks, "--count", "60", "--zones", rules, "--out", run], check=False,
                           stdout=subprocess.DEVNULL)
        return run

    def test_a_page_in_one_file_draws_the_run(self):
        file, run = self.folder / "alone.html", self.finished_run()
        subprocess.run([PROGRAM, "view", run, "--html", file], check=True, stdout=subprocess.DEVNULL)
        page = self.browser.page(file.as_uri())
        page.wait("stillmap.drawn > 0", 120)
        state, summary = self.state(page), json.loads((run / "summary.json").read_text())
        self.assertEqual((state["points"], state["keyframes"], state["zones"]), (summary["cloud_points"], summary["keyframes"], 1))
        self.assertIn("no images of the camera", state["noImage"])
        self.assertGreater(page.run("stillmap.inked()"), 0.02)
        self.assertEqual((state["errors"], page.logs), (0, []))

    def test_two_pages_draw_a_run_in_progress_and_then_the_finished_one(self):
        port = free_port()
        viewed = self.live("browser", port)
        pages = [self.browser.page(viewed.url) for _ in range(2)]
        for page in pages:
            page.wait("stillmap.frames > 5 && stillmap.points > 1000 && stillmap.images > 1 && stillmap.path > 5", 120)
            page.wait("stillmap.drawn > 0")
            self.assertGreater(page.run("stillmap.inked()"), 0.02)
        page = pages[0]
        page.run("document.querySelector('[data-layer=cloud]').click()")
        without = page.run("stillmap.inked()")
        page.run("document.querySelector('[data-layer=cloud]').click()")
        self.assertGreater(page.run("stillmap.inked()"), without)
        for key, view in (("2", "top"), ("3", "follow"), ("1", "orbit")):
            pages[0].key(key)
            self.assertEqual(pages[0].run("stillmap.view"), view)
        self.assertGreater(self.state(pages[0])["keyframes"], 0)
        viewed.wait()
        page = pages[0]
        page.wait("!stillmap.connected")
        self.view("view", self.folder / "browser", "--port", port)
        summary = json.loads((self.folder / "browser/summary.json").read_text())
        page.wait("stillmap.connected && stillmap.connections >= 2 && !stillmap.live", 120)
        page.wait(f"stillmap.points === {summary['cloud_points']} && stillmap.keyframes === {summary['keyframes']} "
                  f"&& stillmap.path >= {summary['frames']['tracked']}", 120)
        state = self.state(page)
        self.assertEqual(state["errors"], 0, page.logs)
        page.run("const t = document.getElementById('time'); t.value = t.min; t.dispatchEvent(new Event('input'))")
        self.assertLess(page.run("stillmap.time - Number(document.getElementById('time').min)"), 0.01)

    def test_warnings_of_a_run_are_shown(self):
        rules = self.folder / "rules.yaml"
        rules.write_text("zones: [{name: gate, polygon: [[-1, 1, 1], [1, 1, 1], [1, 1, 3]]}]\n"
                         "distances: [{to: camera, nearer: 30}]\n")
        viewed = self.live("warned", more=("--zones", rules))
        page = self.browser.page(viewed.url)
        page.wait("stillmap.zones === 1 && stillmap.warnings > 0 && stillmap.active > 0", 120)
        # The newest warning is a sentence; the others are listed by name after it.
        self.assertRegex(page.run("document.getElementById('warnings').textContent"), "from the camera|also: camera")
        viewed.wait()
        events = [json.loads(line) for line in (self.folder / "warned/events.jsonl").read_text().splitlines()]
        self.assertEqual(events[0]["event"], "begin")
        self.assertIn("near", {event["kind"] for event in events})
        # A finished run is shown from its start; the keys N and B jump to its warnings, which are then shown again.
        page = self.browser.page(self.view("view", self.folder / "warned", "--port", "0").url)
        page.wait("stillmap.events > 0 && stillmap.time !== undefined", 120)
        page.wait("stillmap.points > 0")
        self.assertAlmostEqual(page.run("stillmap.time - Number(document.getElementById('time').min)"), 0, delta=1e-3)
        for key in "nnb":
            page.key(key)
        begins = [event["timestamp"] for event in events if event["event"] == "begin" and event["kind"] != "unseen"]
        self.assertLess(min(abs(page.run("stillmap.time") - t) for t in begins), 1e-3)
        page.wait("stillmap.active > 0")
        self.assertEqual(self.state(page)["errors"], 0, page.logs)

    def test_the_slider_shows_the_image_and_the_movers_in_it(self):
        page = self.browser.page(self.view("view", self.finished_run(), "--port", "0").url)
        page.wait("stillmap.entries.length && stillmap.images > 0 && stillmap.points > 1000", 120)
        page.run("document.querySelector('#events button').click()")
        page.wait("stillmap.boxes.length > 0 && stillmap.banners.length > 0")
        state = self.state(page)
        name = re.match(r"(person|object) \d+", state["entries"][0])[0]
        for texts in (state["banners"], state["boxes"]):
            self.assertTrue(any(text.startswith(name + ",") for text in texts), (name, texts))
        self.assertIn(name + " ", page.run("document.getElementById('labels').textContent"))
        for texts in (state["banners"], state["entries"]):
            distances = [float(match[1]) for text in texts if (match := re.search(r"([0-9.]+) m away", text))]
            self.assertEqual(distances, sorted(distances), "the nearest is first")
        before = state["images"]
        page.run("const t = document.getElementById('time'); t.value = t.max; t.dispatchEvent(new Event('input'))")
        page.wait(f"stillmap.images > {before}")
        self.assertEqual(self.state(page)["errors"], 0, page.logs)

    def test_a_run_without_its_recording_says_so_in_place_of_the_image(self):
        run = self.folder / "elsewhere"
        shutil.copytree(self.finished_run(), run)
        text = (run / "summary.json").read_text().replace(str(self.sequence), str(self.folder / "gone"))
        (run / "summary.json").write_text(text)
        page = self.browser.page(self.view("view", run, "--port", "0").url)
        page.wait("/not there any more/.test(stillmap.noImage)", 120)
        self.assertEqual(self.boxes(page, "#figure"), [])
        self.assertEqual(len(self.boxes(page, "#no-image")), 1)

    def test_floor_obstacles_and_free_space_are_layers_of_a_run_with_planner_files(self):
        page = self.browser.page(self.view("view", self.finished_run(), "--port", "0").url)
        page.wait("stillmap.planner && stillmap.points > 1000 && document.querySelector('[data-layer=free]').offsetParent !== null", 120)
        layers = page.run("[...document.querySelectorAll('[data-layer]')].filter((b) => b.offsetParent).map((b) => b.dataset.layer)")
        self.assertEqual(layers[-3:], ["floor", "obstacles", "free"])
        self.assertNotIn("grid", layers)
        page.run("document.querySelector('[data-layer=cloud]').click()")
        for layer in layers[-3:]:
            page.wait("stillmap.rests !== false")
            shown = page.run("stillmap.inked()")
            page.run(f"document.querySelector('[data-layer={layer}]').click()")
            self.assertLess(page.run("stillmap.inked()"), shown, layer)

    def test_a_mesh_is_shown_with_its_texture_in_place_of_the_points(self):
        made, file = self.folder / "with_mesh", self.folder / "mesh.html"
        subprocess.run([PROGRAM, "dense", self.finished_run(), "--mesh=glb", "--out", made], check=True, stdout=subprocess.DEVNULL)
        subprocess.run([PROGRAM, "view", made, "--html", file], check=True, stdout=subprocess.DEVNULL)
        for url in (self.view("view", made, "--port", "0").url, file.as_uri()):
            page = self.browser.page(url)
            page.wait("stillmap.triangles > 1000 && stillmap.texture > 1e5 && stillmap.points > 1000 && stillmap.rests", 120)
            self.assertFalse(page.run("document.querySelector('[data-layer=cloud]').checked"))
            shown = page.run("stillmap.inked()")
            page.run("document.querySelector('[data-layer=mesh]').click()")
            page.wait("stillmap.rests !== false")
            self.assertLess(page.run("stillmap.inked()"), 0.7 * shown)
            self.assertEqual((self.state(page)["errors"], page.logs), (0, []))

    def test_the_time_line_tells_what_is_below_the_pointer(self):
        run = self.folder / "doubtful"
        shutil.copytree(self.finished_run(), run)
        summary = json.loads((run / "summary.json").read_text())
        times = [float(line.split()[0]) for line in (run / "trajectory.txt").read_text().splitlines() if not line.startswith("#")]
        first, last = times[0], times[-1]
        summary["findings"] = [{"code": "focal-length", "severity": "untrusted", "message": "the focal length is wrong", "fix": None,
                                "evidence": {}}]
        summary["frames"].update(uncertain_at=[(first + last) / 2], highly_dynamic=20,
                                 highly_dynamic_periods=[[first, first + 0.4 * (last - first)]])
        (run / "summary.json").write_text(json.dumps(summary))
        page = self.browser.page(self.view("view", run, "--port", "0").url)
        page.wait("stillmap.rows.dynamics && stillmap.rows.warnings", 120)
        self.assertEqual(list(self.state(page)["rows"]), ["camera", "warnings", "findings", "dynamics"])
        self.assertIn("the focal length is wrong", page.run("document.getElementById('findings').textContent"))

        def hint(row, share):
            page.run("(() => { const c = document.getElementById('marks'), b = c.getBoundingClientRect(); c.dispatchEvent(new PointerEvent('pointermove', "
                     f"{{clientX: b.left + {share} * b.width, clientY: b.top + {10 * row + 5}}})); }})()")
            return page.run("stillmap.hint")
        self.assertIn("tracked", hint(0, 0.5))
        self.assertIn("gate", hint(1, 0.9) + hint(1, 0.5) + hint(1, 0.1))
        self.assertIn("uncertain pose", hint(2, 0.5))
        self.assertEqual(hint(2, 0.25).split("\n")[1:], ["the focal length is wrong"])
        self.assertIn("highly dynamic", hint(3, 0.2))
        self.assertEqual(hint(3, 0.8), "")

    def test_each_person_has_one_bar_of_warnings(self):
        page = self.browser.page(self.view("view", self.crowded_run(), "--port", "0").url)
        page.wait("stillmap.events > 8 && stillmap.points > 1000", 120)
        page.run("document.querySelector('#events button.zone').click()")
        page.wait("stillmap.active > 5")
        state = self.state(page)
        people = [match[0] for text in state["banners"] if (match := re.match(r"(person|object) \d+", text))]
        self.assertEqual(len(people), len(set(people)))
        self.assertLessEqual(len(people), state["movers"])
        listed = [text.split(",")[0] for text in state["entries"] if " m away: " in text]
        self.assertEqual(len(listed), len(set(listed)), "one entry per person")
        self.assertRegex(state["banners"][0], r" m away: .*, .*, .* and \d more$")
        self.assertGreater(state["red"], 0, "the movers of the events are found among the final tracks")
        self.assert_apart(self.boxes(page, "#events button"))
        self.assertGreater(max(b - t for _, t, _, b in self.boxes(page, "#events button")), 30, "some texts take two lines")

    def test_a_phone_shows_all_tools_and_panels_without_overlap(self):
        viewed = self.view("view", self.crowded_run(), "--port", "0")
        for width, height in ((390, 844), (320, 568), (844, 390)):
            page = self.browser.page()
            page.size(width, height, phone=True)
            page.open(viewed.url)
            page.wait("stillmap.events > 8 && stillmap.points > 1000", 120)
            page.run("document.querySelector('#events button.zone').click()")
            page.wait("stillmap.active > 5")
            self.assertEqual(self.boxes(page, ".panel"), [], "the panels are closed at first")
            for panel in ("layers", "frame"):
                page.run(f"document.querySelector('[data-panel={panel}]').click()")
                boxes = self.boxes(page, "#top, .panel, #warnings, #tabs, #timeline, #scale")
                self.assertEqual(len(boxes), 6)
                self.assert_apart(boxes)
                for left, top, right, bottom in (*boxes, *self.boxes(page, "#top button")):
                    self.assertTrue(left >= 0 and top >= 0 and right <= width and bottom <= height, (left, top, right, bottom))
            self.assertEqual(len(self.boxes(page, "#zone")), 1)

    def test_banners_can_be_read_in_both_themes(self):
        viewed = self.view("view", self.crowded_run(), "--port", "0")
        contrast = """(() => {
          const light = (text) => { const c = text.match(/[\\d.]+/g).slice(0, 3).map((v) => v / 255)
            .map((v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4); return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; };
          return [...document.querySelectorAll('.warning, #top button.on, .label.alarm')].map((e) => { const style = getComputedStyle(e);
            const [a, b] = [light(style.color), light(style.backgroundColor)].sort((x, y) => y - x); return (a + 0.05) / (b + 0.05); });
        })()"""
        for theme in ("dark", "light"):
            page = self.browser.page(viewed.url + "?theme=" + theme)
            page.wait("stillmap.events > 8 && stillmap.points > 1000", 120)
            page.run("document.querySelector('#events button.zone').click()")
            page.wait("stillmap.active > 5")
            self.assertGreater(min(page.run(contrast)), 4.5, theme)

    def test_a_program_that_stops_is_not_known_to_be_clear(self):
        viewed = self.live("stopped")
        page = self.browser.page(viewed.url)
        page.wait("stillmap.frames > 5 && stillmap.points > 1000", 120)
        page.wait("stillmap.eyeInView()", 30)
        page.wait("stillmap.unknown === ''", 30)
        viewed.process.send_signal(signal.SIGSTOP)
        page.wait("/not known: no image for/.test(stillmap.banners[0])", 30)
        viewed.process.send_signal(signal.SIGCONT)
        page.wait("stillmap.unknown === '' || stillmap.finished", 30)
        viewed.process.kill()
        page.wait("/not known: no connection/.test(stillmap.banners[0])", 30)
        self.assertEqual(page.run("document.getElementById('state').textContent"), "connection lost")

    def test_a_page_without_the_token_says_so(self):
        viewed = self.view("view", self.crowded_run(), "--port", "0", "--view-address", "0.0.0.0")
        page = self.browser.page(f"http://127.0.0.1:{viewed.port}/")
        page.wait("/token/.test(stillmap.banners[0])", 60)

    def test_up_is_that_of_the_rules_or_the_floor_and_otherwise_marked_as_a_guess(self):
        def shown(*arguments):
            page = self.browser.page(self.view("view", *arguments, "--port", "0").url)
            page.wait("stillmap.up && stillmap.renders > 0", 120)
            return self.state(page), page.run("!document.getElementById('guess').hidden")
        run = self.crowded_run()
        state, guess = shown(run)
        self.assertEqual((state["upFrom"], guess), ("floor", False))
        truth = (0.0, -0.9848, -0.1736)
        rules = self.folder / "up.yaml"
        rules.write_text(f"up: {list(truth)}\ndistances: [{{to: camera, nearer: 3}}]\n")
        state, guess = shown(run, "--zones", rules)
        self.assertEqual((state["upFrom"], guess), ("rules", False))
        for a, b in zip(state["up"], truth, strict=True):
            self.assertAlmostEqual(a, b, 3)
        cloud = self.folder / "few.ply"
        cloud.write_bytes(b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n" + bytes(12))
        state, guess = shown(cloud)
        self.assertEqual((state["upFrom"], state["kind"], guess), ("images", "cloud", True))

    def test_a_saved_map_offers_the_layers_that_it_has(self):
        page = self.browser.page(self.view("view", self.crowded_run() / "run.map", "--port", "0").url)
        page.wait("stillmap.points > 1000 && stillmap.keyframes > 0 && stillmap.rests", 120)
        layers = page.run("[...document.querySelectorAll('[data-layer]')].filter((b) => b.offsetParent).map((b) => b.dataset.layer)")
        self.assertEqual(layers, ["cloud", "keyframes", "grid"])
        self.assertTrue(page.run("document.getElementById('colors').options[2].disabled"), "there are no classes")

    def map_changes(self):
        """What `stillmap map changes` writes: a chair went, a table was moved by 3 m, and something unknown appeared."""
        folder = self.folder / "changes"
        if folder.exists():
            return folder
        folder.mkdir()

        def surface(x, y, z):
            return {"min": [x, y, z], "max": [x + 0.6, y + 0.8, z + 0.6]}
        changes = [{"kind": "moved", "class": "table", "before": surface(-2, 0.2, 3), "after": surface(1, 0.2, 3)},
                   {"kind": "went", "class": "chair", "before": surface(0, 0.2, 5)}, {"kind": "appeared", "class": "unknown", "after": surface(2, 0.2, 1)}]
        (folder / "changes.json").write_text(json.dumps({"changes": changes, "before": {"name": "monday"}, "after": {"name": "friday"}}))

        def cloud(name, points):
            header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n" + "".join(f"property float {axis}\n" for axis in "xyz")
                      + "".join(f"property uchar {color}\n" for color in ("red", "green", "blue")) + "end_header\n")
            (folder / name).write_bytes(header.encode() + b"".join(struct.pack("<3f3B", *point) for point in points))
        cloud("after.ply", [(x / 20, 1, z / 20, 90, 90, 90) for x in range(-80, 80) for z in range(160)])
        cloud("changes.ply", [(x / 10, 0.5, 5.3, 214, 39, 40) for x in range(6)] + [(-1.7, 0.5, 3.3, 148, 103, 189)])
        (folder / "after.txt").write_text("".join(f"{i} {i / 10} 0 0 0 0 0 1\n" for i in range(5)))
        return folder

    def test_changes_are_listed_and_a_click_moves_the_view_to_one(self):
        file = self.folder / "changes.html"
        subprocess.run([PROGRAM, "view", self.map_changes(), "--html", file], check=True, stdout=subprocess.DEVNULL)
        for url in (self.view("view", self.map_changes(), "--port", "0").url, file.as_uri()):
            page = self.browser.page(url)
            page.wait("stillmap.changes === 3 && stillmap.keyframes === 5 && document.querySelector('[data-layer=changes]').offsetParent !== null", 120)
            texts = ["table moved 3.00 m", "chair went", "object appeared"]
            self.assertEqual(page.run("[...document.querySelectorAll('#changes button')].map((b) => b.textContent.trim())"), texts)
            self.assertEqual(page.run("[...document.querySelectorAll('.label')].map((e) => e.textContent)"), texts)
            self.assertEqual(page.run("document.getElementById('name').textContent"), "monday → friday")
            layers = page.run("[...document.querySelectorAll('[data-layer]')].filter((b) => b.offsetParent).map((b) => b.dataset.layer)")
            self.assertEqual(layers, ["cloud", "keyframes", "changes", "grid"])
            for key in ("2", "1"):  # in both views, the place of the object comes to the middle
                page.key(key)
                page.run("document.querySelectorAll('#changes button')[1].click()")
                page.wait("""(() => { const r = document.querySelectorAll('.label')[1].getBoundingClientRect(), [x, y] = stillmap.middle();
                  return Math.abs((r.left + r.right) / 2 - x) < 10 && r.bottom < y + 10 && r.bottom > y - 250; })()""")
            page.run("for (const name of ['cloud', 'keyframes', 'grid']) document.querySelector(`[data-layer=${name}]`).click()")
            self.assertGreater(page.run("stillmap.inked()"), 1e-3)
            page.run("document.querySelector('[data-layer=changes]').click()")
            page.wait("[...document.querySelectorAll('.label')].every((e) => e.offsetParent === null)")
            self.assertEqual(page.run("stillmap.inked()"), 0)
            self.assertEqual((self.state(page)["errors"], page.logs), (0, []))

    def test_the_help_opens_at_its_top_and_the_map_is_beside_the_panels(self):
        page = self.browser.page(self.view("view", self.crowded_run(), "--port", "0").url)
        page.wait("stillmap.points > 1000 && !document.getElementById('timeline').hidden && stillmap.rests", 120)
        left, top, right, bottom = page.run("stillmap.free")
        for panel in self.boxes(page, ".panel, #timeline, #top"):
            self.assertTrue(panel[2] <= left or panel[0] >= right or panel[3] <= top or panel[1] >= bottom, panel)
        for key in ("f", "2"):  # the middle of both views, at which they are aimed, is beside the panels
            page.key(key)
            middle = page.run("stillmap.middle()")
            self.assertAlmostEqual(middle[0], (left + right) / 2, delta=2)
            self.assertAlmostEqual(middle[1], (top + bottom) / 2, delta=2)
        page.key("?")
        page.wait("document.getElementById('keys').open")
        self.assertEqual(page.run("document.getElementById('keys').scrollTop"), 0)

    def test_a_page_that_stalls_holds_up_no_other_and_goes_on(self):
        viewed = self.live("stalls")
        stalling, other = (self.browser.page(viewed.url) for _ in range(2))
        for page in (stalling, other):
            page.wait("stillmap.frames > 2", 120)
        stalling.call("Debugger.enable")
        stalling.call("Debugger.pause")
        before = other.run("stillmap.frame")
        other.wait(f"stillmap.frame > {before + 10}")
        stalling.call("Debugger.resume")
        stalling.call("Debugger.disable")
        stalling.wait(f"stillmap.frame > {before + 10}")
        self.assertEqual(self.state(stalling)["errors"], 0, stalling.logs)

    def test_a_zone_is_drawn_and_a_distance_measured_on_a_map(self):
        run = self.folder / "measured"
        subprocess.run([PROGRAM, "run", self.sequence, *self.masks, "--count", "40", "--out", run], check=False,
                       stdout=subprocess.DEVNULL)
        page = self.browser.page(self.view("view", run, "--port", "0").url)
        page.wait("stillmap.points > 1000 && stillmap.renders > 1", 120)
        page.key("2")
        page.key("m")
        page.wait("stillmap.drawn > 1000")
        # Where the map is depends on the size of the page; it has holes, and a slow page still turns to the top view at
        # the first clicks.
        for y, x in itertools.product(range(430, 100, -15), range(280, 600, 20)):
            if page.run("stillmap.measured === undefined"):
                page.click(x, y)
        page.wait("stillmap.measured > 0")
        page.key("Escape")
        page.key("z")
        for x, y in ((400, 260), (560, 260), (560, 400)):
            page.click(x, y)
        page.key("Enter")
        page.wait("stillmap.zones === 1")
        self.assertIn("polygon: [[", page.run("stillmap.zoneYaml"))
        self.assertIn("name: zone 1", page.run("stillmap.zoneYaml"))
        self.assertIn("zone 1", page.run("document.getElementById('labels').textContent"))
        self.assertIn("zones.yaml", page.run("stillmap.notice"))
        self.assertEqual(self.state(page)["errors"], 0, page.logs)


if __name__ == "__main__":
    PROGRAM = str(Path(sys.argv[1]).resolve())
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The page of the view in a headless Chromium, and its server; without a Chromium the tests of the page are skipped.

  apps/view_test.py PROGRAM     PROGRAM: the built command
"""
import http.client
import itertools
import json
import socket
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
        for path in ("/view.js", "/view.css", "/three.min.js", "/OrbitControls.js", "/icon.svg"):
            self.assertEqual(self.get(viewed, path)[0].status, 200, path)
        for path in ("/../README.md", "/etc/passwd", "/view.js/x", "//etc/passwd", "/%2e%2e/README.md"):
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


@unittest.skipUnless(find_browser(), "skipped: there is no Chromium")
class InTheBrowser(ViewTest):
    def setUp(self):
        self.browser = Browser(960, 640)
        self.addCleanup(self.browser.__exit__)

    def state(self, page):
        return json.loads(page.run(STATE))

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
        page.wait("stillmap.connected && stillmap.connections >= 2 && !stillmap.live && stillmap.points > 1000", 120)
        state = self.state(page)
        summary = json.loads((self.folder / "browser/summary.json").read_text())
        self.assertEqual(state["points"], summary["cloud_points"])
        self.assertEqual(state["keyframes"], summary["keyframes"])
        self.assertGreaterEqual(state["path"], summary["frames"]["tracked"])
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
        self.assertIn("from the camera", page.run("document.getElementById('warnings').textContent"))
        viewed.wait()
        events = [json.loads(line) for line in (self.folder / "warned/events.jsonl").read_text().splitlines()]
        self.assertEqual(events[0]["event"], "begin")
        self.assertIn("near", {event["kind"] for event in events})
        # On the finished run the key B jumps to the previous warning, where it is shown again.
        page = self.browser.page(self.view("view", self.folder / "warned", "--port", "0").url)
        page.wait("stillmap.events > 0 && stillmap.time !== undefined", 120)
        page.wait("stillmap.points > 0")
        for _ in range(2):
            page.key("b")
        begins = [event["timestamp"] for event in events if event["event"] == "begin" and event["kind"] != "unseen"]
        self.assertLess(min(abs(page.run("stillmap.time") - t) for t in begins), 1e-3)
        page.wait("stillmap.active > 0")
        self.assertEqual(self.state(page)["errors"], 0, page.logs)

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
        # Some of the places are holes in the map, and a slow page still turns to the top view at the first clicks.
        for y, x in itertools.product(range(330, 430, 10), range(420, 560, 20)):
            if page.run("stillmap.measured === undefined"):
                page.click(x, y)
        self.assertGreater(page.run("stillmap.measured"), 0)
        page.key("Escape")
        page.key("z")
        for x, y in ((400, 260), (560, 260), (560, 400)):
            page.click(x, y)
        page.key("Enter")
        page.wait("stillmap.zones === 1")
        self.assertIn("polygon: [[", page.run("stillmap.zoneYaml"))
        self.assertEqual(self.state(page)["errors"], 0, page.logs)


if __name__ == "__main__":
    PROGRAM = str(Path(sys.argv[1]).resolve())
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])

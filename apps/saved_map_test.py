#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Saved maps on the command line: saved, shown, exported, used again; and command lines that are refused.

  apps/saved_map_test.py PROGRAM     PROGRAM: the built command
"""
import base64
import hashlib
import json
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import old_map

PROGRAM = ""


def stillmap(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, check=False)


def poses_in(file):
    """Returns the rows of a trajectory without their times: x, y, z, and the quaternion x, y, z, w."""
    return [list(map(float, line.split()[1:])) for line in file.read_text().splitlines() if line[0] != "#"]


class SavedMaps(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name)
        cls.sequence = cls.folder / "sequence"
        cls.map = cls.folder / "maps" / "first.map"
        made = stillmap("simulate", "--people", 0, "--frames", 30, "--width", 320, "--height", 240,
                        "--out", cls.sequence)
        assert made.returncode == 0, made.stderr
        saved = cls.run_sequence("first", "--save-map", cls.map)
        assert saved.returncode == 0, saved.stderr

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    @classmethod
    def run_sequence(cls, out, *more):
        return stillmap("run", cls.sequence, "--preset", "static", "--out", cls.folder / out, *more)

    def refused(self, result, code, *words):
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        for word in words:
            self.assertIn(word, result.stdout + result.stderr)

    def test_info_says_what_the_run_said(self):
        json_file = self.folder / "info.json"
        shown = stillmap("map", "info", self.map, "--json", json_file)
        self.assertEqual(shown.returncode, 0, shown.stderr)
        info = json.loads(json_file.read_text())
        summary = json.loads((self.folder / "first" / "summary.json").read_text())
        self.assertEqual(info["keyframes"], summary["keyframes"])
        self.assertEqual(info["landmarks"], summary["landmarks"])
        self.assertEqual(info["bytes"], self.map.stat().st_size)
        self.assertEqual(info["camera"]["width"], 320)
        self.assertIn(f"{info['keyframes']} with", shown.stdout)

    def test_export_writes_what_others_read(self):
        out = self.folder / "export"
        self.assertEqual(stillmap("map", "export", self.map, "--out", out).returncode, 0)
        graph = json.loads((out / "graph.json").read_text())
        poses = [line for line in (out / "keyframes.txt").read_text().splitlines() if line[0] != "#"]
        self.assertEqual(len(poses), len(graph["keyframes"]))
        for name in ("landmarks.ply", "cloud.ply"):
            self.check_ply(out / name)
        shown = {keyframe["id"] for keyframe in graph["keyframes"]}
        self.assertTrue(all(edge["a"] in shown and edge["b"] in shown for edge in graph["covisible"]))

    def test_export_for_other_programs_has_the_images_in_full_size(self):
        out = self.folder / "scene"
        done = stillmap("map", "export", self.map, "--for", "colmap,colmap-text,nerfstudio,las", "--out", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        scene = json.loads((out / "transforms.json").read_text())
        self.assertEqual((scene["w"], scene["h"]), (320, 240))
        for frame in scene["frames"]:
            self.assertEqual((out / frame["file_path"]).read_bytes()[:2], b"\xff\xd8")  # a JPEG file
            for kind in ("mask_path", "depth_file_path"):
                self.assertRegex((out / frame[kind]).read_bytes()[16:24].hex(), "00000140000000f0")  # size in a PNG
        self.assertEqual({file.suffix for file in (out / "sparse/0").iterdir()}, {".bin"})
        self.refused(stillmap("map", "export", self.map, "--for", "e57"), 1, "no format 'e57'", "nerfstudio")

    def test_other_programs_read_the_exported_files(self):
        python = Path(__file__).resolve().parent.parent / "build/surface_venv/bin/python"
        if not python.exists():
            self.skipTest("skipped: there is no build/surface_venv with pycolmap and laspy")
        out = self.folder / "read"
        self.assertEqual(stillmap("map", "export", self.folder / "first", "--for", "colmap,colmap-text,las", "--out",
                                  out).returncode, 0)
        program = """
import laspy, pycolmap, sys
models = [pycolmap.Reconstruction(f"{sys.argv[1]}/{folder}/0") for folder in ("sparse", "sparse_text")]
las = laspy.read(f"{sys.argv[1]}/cloud.las")
for model in models:
    image = next(iter(model.images.values()))
    print(len(model.images), len(model.points3D), len(las.points), image.name, model.cameras[image.camera_id].params)
"""
        done = subprocess.run([python, "-c", program, out], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        first, second = done.stdout.splitlines()
        self.assertEqual(first, second)
        images, points, las = first.split()[:3]
        self.assertEqual(int(images), len(list((out / "images").iterdir())))
        self.assertEqual(points, las)

    def test_other_programs_read_the_meshes(self):
        python = Path(__file__).resolve().parent.parent / "build/surface_venv/bin/python"
        if not python.exists():
            self.skipTest("skipped: there is no build/surface_venv with Open3D and trimesh")
        out = self.folder / "meshes"
        self.assertEqual(stillmap("dense", self.map, "--mesh", "ply,glb,obj", "--out", out).returncode, 0)
        program = """
import open3d, sys, trimesh
for name in ("mesh.glb", "mesh.obj"):
    first = trimesh.load(f"{sys.argv[1]}/{name}", force="mesh")
    material, second = first.visual.material, open3d.io.read_triangle_mesh(f"{sys.argv[1]}/{name}", True)
    image = material.baseColorTexture if name.endswith("glb") else material.image
    print(len(first.faces), len(second.triangles), *image.size, second.has_triangle_uvs())
print(len(open3d.io.read_triangle_mesh(f"{sys.argv[1]}/mesh.ply").triangles))
"""
        done = subprocess.run([python, "-c", program, out], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        glb, obj, ply = done.stdout.splitlines()
        self.assertEqual(glb, obj)
        trimesh, open3d, width, height, has_places = glb.split()
        self.assertEqual((trimesh, has_places), (open3d, "True"))
        self.assertLess(3 * int(trimesh), int(ply))
        self.assertGreater(int(width) * int(height), 100000)

    def check_ply(self, file):
        """The header is one, and as many bytes follow as it says."""
        header, body = file.read_bytes().split(b"end_header\n", 1)
        lines = header.decode().splitlines()
        self.assertEqual(lines[:2], ["ply", "format binary_little_endian 1.0"], file)
        count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
        size = {"float": 4, "double": 8, "uchar": 1, "int": 4, "uint": 4}
        vertex = sum(size[line.split()[1]] for line in lines if line.startswith("property"))
        self.assertGreater(count, 0)
        self.assertEqual(len(body), count * vertex, file)

    def test_the_static_map_is_made_again_to_the_last_byte(self):
        run = self.folder / "first"
        for source in (run, self.map):
            out = self.folder / f"dense_of_{source.name}"
            result = stillmap("dense", source, "--out", out, "--mesh", "ply")
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual((out / "cloud.ply").read_bytes(), (run / "cloud.ply").read_bytes())
            self.assertTrue((out / "mesh.ply").read_bytes().startswith(b"ply"))
        coarse = self.folder / "coarse"
        self.assertEqual(stillmap("dense", run, "--out", coarse, "--voxel", 0.05).returncode, 0)
        self.assertLess((coarse / "cloud.ply").stat().st_size, 0.3 * (run / "cloud.ply").stat().st_size)

    def test_dense_uses_the_options_that_it_names_and_refuses_all_others(self):
        run, in_use = self.folder / "first", {}
        refused = stillmap("dense", run, "--set", "dense.stride=4", "--out", self.folder / "refused")
        self.refused(refused, 1, "--set dense.stride=4", "has no effect", "fix:")
        self.assertFalse((self.folder / "refused").exists())
        for setting in ("dense.voxel=0.05", "dense.memory=0", "outputs.mesh_voxel=0.1",
                        "outputs.planner_cell=0.2", "outputs.planner_lowest=1.5", "outputs.planner_highest=0.3"):
            in_use[setting.split("=")[0]] = setting
        self.assertEqual(set(re.findall(r"(?:dense|outputs)\.\w+", refused.stderr.split("fix:")[1])), set(in_use))
        for line in stillmap("options").stdout.splitlines():
            if re.match(r"\w+:$", line):
                group = line[:-1]
            name = re.match(r"  (\w+): ?(.*)", line)
            if name and f"{group}.{name[1]}" not in in_use:
                value = name[2].strip('"[]') or "x"
                self.refused(stillmap("dense", run, "--set", f"{group}.{name[1]}={value}"), 1, "has no effect")
        plain = self.dense_files("plain")
        for name, setting in in_use.items():
            same = self.dense_files(name, "--set", setting) == plain
            self.assertEqual(same, name == "dense.memory", setting)
        self.refused(stillmap("dense", run, "--voxel", -1), 1, "dense.voxel", "0.001 to 1")

    def test_with_little_memory_all_files_of_a_run_are_the_same(self):
        little = self.folder / "maps" / "little.map"
        result = self.run_sequence("little", "--memory", 0, "--save-map", little)
        self.assertEqual(result.returncode, 0, result.stderr)
        run, first = self.folder / "little", self.folder / "first"
        for name in ("trajectory.txt", "cloud.ply", "run.map"):
            self.assertEqual((run / name).read_bytes(), (first / name).read_bytes(), name)
        self.assertEqual(little.read_bytes(), self.map.read_bytes())
        summary = json.loads((run / "summary.json").read_text())
        self.assertEqual(summary["cloud_views_on_disk"], summary["cloud_views"])
        extended = [self.run_sequence(f"extended_{memory}", "--memory", memory, "--load-map", little).returncode
                    for memory in (0, 1000)]
        self.assertEqual(extended, [0, 0])
        self.assertEqual((self.folder / "extended_0" / "cloud.ply").read_bytes(),
                         (self.folder / "extended_1000" / "cloud.ply").read_bytes())
        self.refused(self.run_sequence("less", "--memory", -1), 1, "dense.memory", "0 to 1000000")

    def dense_files(self, out, *more):
        """Hashes of the files that `stillmap dense` makes of the map with these arguments."""
        folder = self.folder / f"dense_{out}"
        made = stillmap("dense", self.map, "--mesh=ply", "--planner", "--up", "0,-0.99,-0.15", "--camera-height", 1.35, "--out", folder, *more)
        self.assertEqual(made.returncode, 0, made.stderr)
        return {file.name: hashlib.sha256(file.read_bytes()).hexdigest()
                for file in folder.iterdir() if not file.name.startswith(".")}

    def test_what_holds_no_static_map_is_refused(self):
        self.refused(stillmap("dense", self.sequence), 1, "no run.map", "fix:")
        slim = self.folder / "no_views.map"
        self.run_sequence("no_views", "--save-map", slim, "--slim-map")
        self.refused(stillmap("dense", slim), 1, "--slim-map", "fix:")
        self.refused(stillmap("dense", self.folder / "none.map"), 1, "none.map", "fix:")
        self.refused(stillmap("dense", self.map, "--mesh", "stl"), 1, "stl", "fix:")

    def test_localizing_leaves_the_file_and_gives_every_frame_a_pose(self):
        before = self.map.read_bytes()
        result = self.run_sequence("again", "--load-map", self.map, "--localize-only")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("30 of 30 frames tracked", result.stdout)
        self.assertEqual(self.map.read_bytes(), before)
        summary = json.loads((self.folder / "again" / "summary.json").read_text())
        self.assertFalse(summary["loaded_map"]["extended"])
        self.assertEqual(summary["loaded_map"]["frames_by_component"], {"0": 30})
        first = json.loads((self.folder / "first" / "summary.json").read_text())
        self.assertEqual(summary["cloud_points"], first["cloud_points"])

    def test_a_map_can_be_extended_onto_itself(self):
        other = self.folder / "grown.map"
        other.write_bytes(self.map.read_bytes())
        result = self.run_sequence("grown", "--load-map", other, "--save-map", other)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(stillmap("map", "info", other).returncode, 0)

    def test_a_map_of_version_0_1_is_read(self):
        file, out = self.folder / "old.map", self.folder / "old"
        file.write_bytes(old_map.old_map())
        exported = stillmap("map", "export", file, "--out", out)
        self.assertEqual(exported.returncode, 0, exported.stderr)
        poses = [line.split() for line in (out / "keyframes.txt").read_text().splitlines() if line[0] != "#"]
        self.assertEqual([float(pose[1]) for pose in poses], [0, 0.1])
        json_file = self.folder / "old.json"
        self.assertEqual(stillmap("map", "info", file, "--json", json_file).returncode, 0)
        info = json.loads(json_file.read_text())
        self.assertEqual(info["writer"], old_map.PROGRAM)
        self.assertEqual(info["observations"], 2)
        self.assertEqual(info["components"][0]["extent_max"], list(old_map.LANDMARK))

    def test_a_slim_map_is_smaller(self):
        slim, slimmed = self.folder / "slim.map", self.folder / "slimmed.map"
        self.run_sequence("slim", "--save-map", slim, "--slim-map")
        self.assertLess(slim.stat().st_size, 0.7 * self.map.stat().st_size)
        self.assertEqual(stillmap("map", "slim", self.map, "--out", slimmed).returncode, 0)
        self.assertEqual(slimmed.read_bytes(), slim.read_bytes())

    def test_a_damaged_map_is_refused_before_the_run(self):
        damaged = self.folder / "damaged.map"
        damaged.write_bytes(self.map.read_bytes()[:-100])
        for result in (self.run_sequence("x", "--load-map", damaged), stillmap("map", "info", damaged),
                       stillmap("map", "export", damaged, "--out", self.folder / "x")):
            self.refused(result, 1, "damaged.map", "truncated", "fix:")
        self.assertFalse((self.folder / "x").exists())

    def test_another_pyramid_is_refused(self):
        self.refused(self.run_sequence("y", "--load-map", self.map, "--set", "features.levels=5"), 1,
                     "pyramid levels", "--set features.levels=8")

    def test_a_map_of_another_camera_is_used_with_a_message(self):
        other = self.folder / "other"
        made = stillmap("simulate", "--people", 0, "--frames", 30, "--width", 400, "--height", 300, "--out", other)
        self.assertEqual(made.returncode, 0, made.stderr)
        done = stillmap("run", other, "--preset", "static", "--out", self.folder / "by_other", "--load-map", self.map)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("map of another camera (simulated)", done.stdout)

    def test_an_aligned_map_gives_poses_at_the_site(self):
        """The site is the map turned by 90 degrees about z, and moved."""
        def at_site(x, y, z):
            return 100 - y, x - 20, z + 3
        survey = self.folder / "survey.csv"
        survey.write_text("".join(",".join([name, *map(str, (*p, *at_site(*p)))]) + "\n" for name, p in
                                  (("a", (0, 0, 0)), ("b", (3, 0, 1)), ("c", (0, 2, 1)), ("d", (1, 1, 4)))))
        aligned = self.folder / "site.map"
        shown = stillmap("map", "align", self.map, "--points", survey, "--out", aligned)
        self.assertEqual(shown.returncode, 0, shown.stderr)
        self.assertIn("RMS 0.0 mm", shown.stdout)
        for name, file in (("there", aligned), ("here", self.map)):
            found = self.run_sequence(name, "--load-map", file, "--localize-only")
            self.assertEqual(found.returncode, 0, found.stderr)
        there, here = (poses_in(self.folder / name / "trajectory.txt") for name in ("there", "here"))
        self.assertEqual(len(there), len(here))
        for a, b in zip(there, here):
            for x, y in zip(a[:3], at_site(*b[:3])):
                self.assertAlmostEqual(x, y, delta=1e-3)
        self.refused(stillmap("map", "align", aligned, "--points", survey, "--out", aligned), 1, "is one of the maps to read")
        # A merge is in the frame of the site, although the other map is older.
        newer, other, merged = (self.folder / name for name in ("newer.map", "newer_site.map", "both.map"))
        self.assertEqual(self.run_sequence("newer", "--first", 10, "--save-map", newer).returncode, 0)
        self.assertEqual(stillmap("map", "align", newer, "--points", survey, "--out", other).returncode, 0)
        done = stillmap("map", "merge", self.map, other, "--out", merged)
        self.assertIn(f"component 0 is in the world of {other}", done.stdout)
        self.assertIn("in the frame of a site", stillmap("map", "info", merged).stdout)
        survey.write_text("a,0,0,0,1,1,1\n")
        self.refused(stillmap("map", "align", self.map, "--points", survey, "--out", aligned), 1, "1 points, too few")

    def test_a_map_is_aligned_with_a_floor_plan(self):
        """Any image is the plan: 320 x 240 pixels of 3 cm. Its truth is that of the room, whose floor is at z = 0."""
        truth = poses_in(self.sequence / "groundtruth.txt")

        def at_site(p):  # by the pose of the first camera, which is the frame of the map
            *t, x, y, z, w = truth[0]
            R = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                 [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                 [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
            return [sum(a * b for a, b in zip(row, p)) + c for row, c in zip(R, t)]
        plan = next((self.sequence / "rgb").iterdir())
        points = {"a": (0, 0, 1), "b": (1, 0, 3), "c": (-1, 0.5, 2), "d": (0, 1, 4)}
        survey, aligned = self.folder / "plan.csv", self.folder / "on_plan.map"
        survey.write_text("".join(f"{name},{p[0]},{p[1]},{p[2]},{at_site(p)[0] / .03},{240 - at_site(p)[1] / .03}\n"
                                  for name, p in points.items()))
        shown = stillmap("map", "align", self.map, "--points", survey, "--plan", plan, "--scale", .03, "--out", aligned)
        self.assertEqual(shown.returncode, 0, shown.stdout + shown.stderr)
        self.assertNotEqual((self.folder / "on_plan.plan.png").read_bytes(), plan.read_bytes())
        self.assertEqual(self.run_sequence("on_plan", "--load-map", aligned, "--localize-only", "--planner").returncode, 0)
        found = poses_in(self.folder / "on_plan" / "trajectory.txt")
        self.assertEqual(len(found), len(truth))
        for a, b in zip(found, truth):
            for x, y in zip(a[:3], b):
                self.assertAlmostEqual(x, y, delta=.03)
        floor = json.loads((self.folder / "on_plan" / "floor.json").read_text())
        self.assertEqual(floor["T_map_world"][:2] + floor["T_map_world"][3:], [0, 0, 0, 0, 0, 1])
        self.refused(stillmap("map", "align", self.map, "--points", survey, "--plan", plan, "--scale", .06, "--out", aligned), 1,
                     "2 times those in the map")
        self.refused(stillmap("map", "align", self.map, "--points", survey, "--plan", plan, "--out", aligned), 2, "requires --scale")

    def test_maps_are_merged_in_any_order(self):
        second = self.folder / "second.map"
        self.assertEqual(self.run_sequence("second", "--first", 10, "--save-map", second).returncode, 0)
        merged, description = self.folder / "merged.map", self.folder / "merged.json"
        done = stillmap("map", "merge", self.map, second, "--out", merged, "--json", description)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        pair = json.loads(description.read_text())["pairs"][0]
        self.assertTrue(pair["connected"])
        self.assertIn(f"{pair['places']} common place", done.stdout)
        turned = self.folder / "turned.map"
        self.assertEqual(stillmap("map", "merge", second, self.map, "-o", turned).returncode, 0)
        self.assertEqual(turned.read_bytes(), merged.read_bytes())
        self.assertEqual(self.run_sequence("in_merged", "--load-map", merged, "--localize-only").returncode, 0)
        self.refused(stillmap("map", "merge", self.map, "-o", turned, "--force"), 1, "at least two maps", "fix:")
        self.refused(stillmap("map", "merge", self.map, self.map, "-o", turned, "--force"), 1, "is the same map as", "fix:")
        self.refused(stillmap("map", "merge", self.map, second), 2, "--out")

    def test_what_changed_between_two_visits_is_listed_and_drawn(self):
        later, changes = self.folder / "later", self.folder / "changes"
        stillmap("simulate", "--people", 0, "--frames", 30, "--width", 320, "--height", 240, "--visit", 2, "--speed", 0.8, "--out", later)
        self.assertIn("shelf,", (later / "rearranged.csv").read_text())
        self.assertEqual(stillmap("run", later, "--preset", "static", "--out", self.folder / "visit").returncode, 0)
        extended = stillmap("run", later, "--preset", "static", "--load-map", self.map, "--out", self.folder / "extended")
        lines = [json.loads(line) for line in (self.folder / "extended" / "changes.jsonl").read_text().splitlines()]
        self.assertEqual([line["kind"] for line in lines], re.findall(r"^[0-9.]+ s: (appeared|went|moved)", extended.stdout, re.M))
        self.assertIn("went", {line["kind"] for line in lines})
        done = stillmap("map", "changes", self.map, self.folder / "visit", "--out", changes)
        self.assertEqual(done.returncode, 0, done.stderr)
        found = json.loads((changes / "changes.json").read_text())
        self.assertIn("went", {change["kind"] for change in found["changes"]})
        self.assertGreater(found["after"]["compared"], 0.8)
        self.assertTrue((changes / "changes.png").read_bytes().startswith(b"\x89PNG"))
        def points(name):
            data = (changes / name).read_bytes().split(b"end_header\n", 1)[1]
            return {data[i:i + 12]: tuple(data[i + 12:i + 15]) for i in range(0, len(data), 15)}
        later, colors = points("after.ply"), {(44, 160, 44): True, (31, 119, 180): True, (214, 39, 40): False, (148, 103, 189): False}
        changed = points("changes.ply")
        self.assertGreater(len(changed), 100)
        for point, color in changed.items():  # what appeared or was moved to a place is in the later map, in the same frame
            self.assertEqual(point in later, colors[color])
        self.assertGreater(len((changes / "after.txt").read_text().splitlines()), 2)
        page = self.folder / "changes.html"
        self.assertEqual(stillmap("view", changes, "--html", page).returncode, 0)
        messages = [json.loads(base64.b64decode(text)) for text in re.findall('data-kind="json">([^<]*)<', page.read_text())]
        viewed = next(message for message in messages if message["type"] == "changes")
        self.assertEqual([change["kind"] for change in viewed["changes"]], [change["kind"] for change in found["changes"]])
        self.assertEqual((viewed["before"], viewed["after"]), (found["before"]["name"], found["after"]["name"]))
        self.refused(stillmap("map", "changes", self.map, "--out", changes), 2, "files")
        self.refused(stillmap("map", "changes", self.map, self.map, "--out", changes), 1, "has no visit that", "fix:")
        (changes / "changes.json").write_text('{"changes": 3}')
        self.refused(stillmap("view", changes, "--html", page), 1, "changes.json", "fix: run `stillmap map changes` again")
        (changes / "changes.json").unlink()
        self.refused(stillmap("view", changes, "--html", page), 1, "is no folder of results", "map changes")

    def test_command_lines_that_make_no_sense(self):
        self.refused(self.run_sequence("z", "--localize-only"), 2, "--load-map")
        self.refused(self.run_sequence("z", "--load-map", self.map, "--localize-only", "--save-map", "a.map"), 2,
                     "--save-map")
        self.refused(self.run_sequence("z", "--slim-map"), 2, "--save-map")
        self.refused(self.run_sequence("z", "--save-map", self.folder), 1, "is a folder")
        self.refused(self.run_sequence("z", "--save-map", self.map / "below" / "a.map"), 1, "fix:")
        self.refused(self.run_sequence("z", "--load-map", self.folder / "none.map"), 1, "none.map", "fix:")
        self.refused(stillmap("map"), 2)
        self.refused(stillmap("map", "info"), 2, "file")
        self.refused(stillmap("map", "info", self.sequence / "rgb.txt"), 1, "is not a saved map")
        self.refused(stillmap("map", "export", self.map, "--out", self.map), 1, "fix:")


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    unittest.main()

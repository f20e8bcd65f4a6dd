# SPDX-License-Identifier: Apache-2.0
"""Compares the static map, as a surface, with the one that Open3D integrates from the same poses and masks.

  build/surface_venv/bin/python -m lab surface SEQUENCE ... --out RESULTS --model yolo11n-seg_256x320.onnx

Every tenth frame is left out of both maps. Open3D: `VoxelBlockGrid` of 1 cm, every other frame, depth to 4 m, weight of
at least 3. Masks: mask/ of the sequence if it exists, otherwise people of the network, widened by 10 pixels for Open3D.

  distance, complete, kept, ghosts   as `stillmap eval --cloud`, where the true surface or the true masks are known; a mesh is
                                     judged by points on its triangles, four per square centimeter
  PSNR, SSIM     of the static pixels of the frames left out, against the map drawn at their (interpolated) poses, where all
                 maps have a color; one gain per frame and channel is fitted, since exposure varies
  explained      share of the static depths to 4 m of these frames within two standard deviations (at least 1 cm) of the map
  thickness      5 to 95 % of the distances from planes fitted to patches of 40 cm, the median of all patches

Needs: python3 -m venv build/surface_venv && build/surface_venv/bin/pip install open3d scikit-image
"""
import io
import json
import sys
from pathlib import Path

from lab import core, judge

try:
    import numpy as np
    import open3d as o3d
    from scipy import ndimage
    from skimage.io import imread
    from skimage.metrics import structural_similarity
except ImportError as missing:  # only this subcommand needs them
    np, MISSING = None, missing.name

LEFT_OUT = 10  # every n-th frame
FARTHEST = 4.0  # m, of Open3D's depths
WIDENED = 10  # pixels, of a network's masks
SAMPLES = 40000  # points on a square meter of a mesh
HEAD = ["sequence", "map", "points", "ghosts", "distance: median, 95 % [mm]", "stray [%]", "complete 2 cm; 5 cm [%]", "kept [%]",
        "PSNR [dB]", "SSIM", "drawn [%]", "explained [%]", "floor [mm]", "walls [mm]"]


# ------------------------------------------------------------------------------------------------- frames and poses


def pairs_of(sequence):
    """Returns the rows of associations.txt, made from rgb.txt and depth.txt (the nearest depth image) if it is missing."""
    def rows(name):
        lines = (sequence / name).read_text(encoding="utf-8").splitlines()
        return [line.split() for line in lines if line and not line.startswith("#")]
    if (sequence / "associations.txt").is_file():
        return rows("associations.txt")
    depths = rows("depth.txt")
    stamps = np.array([float(row[0]) for row in depths])
    nearest = [(row, int(np.argmin(np.abs(stamps - float(row[0]))))) for row in rows("rgb.txt")]
    return [row + depths[i] for row, i in nearest if abs(stamps[i] - float(row[0])) < 0.02]


def split(sequence, out):
    """Writes the pairs of the frames of the maps and of those left out; returns both files."""
    files, pairs = (out / "mapped.txt", out / "left_out.txt"), pairs_of(sequence)
    if not files[0].exists():
        left = [i % LEFT_OUT == LEFT_OUT // 2 for i in range(len(pairs))]
        for file, wanted in zip(files, (False, True)):
            file.write_text("".join(" ".join(row) + "\n" for row, is_left in zip(pairs, left) if is_left == wanted))
    return files


def pose_at(trajectory, stamp):
    """Returns T_world_camera (4 x 4) at a time by interpolation; None where the poses around it are more than .2 s apart."""
    after = int(np.searchsorted(trajectory[:, 0], stamp - 1e-6))
    if after == len(trajectory):
        return None
    low = high = trajectory[after]
    if abs(high[0] - stamp) > 1e-6:
        low = trajectory[after - 1] if after else None
    if low is None or high[0] - low[0] > 0.2:
        return None
    share = 0 if low is high else (stamp - low[0]) / (high[0] - low[0])
    q = (1 - share) * low[4:8] + share * high[4:8] * np.sign(low[4:8] @ high[4:8])
    pose = np.eye(4)
    pose[:3, :3] = judge.rotation(q / np.linalg.norm(q))
    pose[:3, 3] = (1 - share) * low[1:4] + share * high[1:4]
    return pose


def pixel_corners(camera):
    """Returns the camera matrix for Open3D, whose pixel centers are at halves."""
    return camera.matrix + [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]]


def depth_sigma(z):
    """Returns the standard deviation of a Kinect's depth [m]."""
    return 0.001504 - 0.00152 * z + 0.0019 * z**2


class Recording:
    """The frames of a sequence with their poses in the run's world and their masks."""

    def __init__(self, sequence, run, masks, widened):
        sys.path.insert(0, str(core.ROOT / "build/release/python"))
        import stillmap  # pylint: disable=import-outside-toplevel
        self.sequence, self.source = sequence, stillmap.source
        self.camera = self.source(sequence).camera
        self.trajectory = judge.trajectory_of(run / "trajectory.txt")
        self.masks = {round(float(file.stem), 3): file for file in masks.glob("*.png")}
        self.widened = widened

    def static(self, stamp, shape):
        """Returns the pixels outside of the masks."""
        file = self.masks.get(round(stamp, 3))
        if file is None:
            return np.ones(shape, bool)
        mask = np.asarray(o3d.io.read_image(str(file))) > 0
        return ~(ndimage.binary_dilation(mask, iterations=self.widened) if self.widened else mask)

    def frames(self, pairs):
        """Yields color, depth of static pixels [m], static pixels and pose of the frames in a list that have a pose."""
        for frame in self.source(self.sequence, associations=pairs):
            pose = pose_at(self.trajectory, frame.stamp)
            if pose is not None:
                static = self.static(frame.stamp, frame.depth.shape)
                yield frame.rgb, np.where(static, frame.depth, 0).astype(np.float32), static, pose


# ------------------------------------------------------------------------------------------------------------- maps


def integrated(recording, pairs):
    """Returns Open3D's points and mesh of the frames."""
    core3d, camera = o3d.core, recording.camera
    grid = o3d.t.geometry.VoxelBlockGrid(("tsdf", "weight", "color"), (core3d.float32,) * 3, ((1), (1), (3)), 0.01, 16, 40000)
    K = core3d.Tensor(pixel_corners(camera))
    for rgb, depth, _, pose in recording.frames(pairs):
        depth = o3d.t.geometry.Image(core3d.Tensor(depth))
        color = o3d.t.geometry.Image(core3d.Tensor(rgb.astype(np.float32) / 255))
        T = core3d.Tensor(np.linalg.inv(pose))
        blocks = grid.compute_unique_block_coordinates(depth, K, T, 1.0, FARTHEST)
        grid.integrate(blocks, depth, color, K, K, T, 1.0, FARTHEST)
    return grid.extract_point_cloud(3.0), grid.extract_triangle_mesh(3.0)


def array(tensor):
    return tensor.cpu().numpy()


def colors_of(geometry):
    """Returns the colors of points or vertices [0..1]."""
    color = array(geometry["colors"])
    return color.astype(np.float32) / (255 if color.dtype == np.uint8 else 1)


class PointMap:
    """A cloud, drawn as squares of the size of its voxels."""

    def __init__(self, points, colors, voxel=0.01):
        self.points, self.colors, self.voxel = points, colors, voxel

    def samples(self):
        return self.points, self.colors

    def drawn(self, camera, pose):
        """Returns depth [m], 0 where there is nothing, and color [0..1] at a pose."""
        size = (camera.height, camera.width)
        depth, color = np.full(size, np.inf, np.float32), np.zeros((*size, 3), np.float32)
        p = (self.points - pose[:3, 3]) @ pose[:3, :3]
        kept = p[:, 2] > 0.2
        p, c = p[kept], self.colors[kept]
        u, v = camera.fx * p[:, 0] / p[:, 2] + camera.cx, camera.fy * p[:, 1] / p[:, 2] + camera.cy
        half = np.ceil(np.minimum(0.6 * self.voxel * camera.fx / p[:, 2], 8)).astype(int)
        for reach in range(-8, 9):
            for across in range(-8, 9):
                some = half >= max(abs(reach), abs(across))
                col, row = np.rint(u[some]).astype(int) + across, np.rint(v[some]).astype(int) + reach
                inside = (col >= 0) & (col < camera.width) & (row >= 0) & (row < camera.height)
                self.put(depth, color, row[inside], col[inside], p[some][inside, 2], c[some][inside])
        depth[np.isinf(depth)] = 0
        return depth, color

    @staticmethod
    def put(depth, color, row, col, z, c):
        order = np.argsort(-z, kind="stable")  # the nearest is written last
        nearer = z[order] < depth[row[order], col[order]] - 0.01
        order = order[nearer]
        depth[row[order], col[order]], color[row[order], col[order]] = z[order], c[order]


class MeshMap:
    """A triangle mesh with colors of its vertices, drawn by casting rays."""

    def __init__(self, mesh):
        self.colors = colors_of(mesh.vertex)
        self.set_surface(array(mesh.vertex["positions"]), array(mesh.triangle["indices"]))

    def set_surface(self, vertices, triangles):
        self.vertices, self.triangles = vertices, triangles
        self.scene = o3d.t.geometry.RaycastingScene()
        self.scene.add_triangles(o3d.core.Tensor(self.vertices), o3d.core.Tensor(self.triangles.astype(np.uint32)))

    def samples(self):
        """Returns points on the triangles, and their colors."""
        random = np.random.default_rng(1)
        a, b, c = (self.vertices[self.triangles[:, i]] for i in range(3))
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        chosen = np.repeat(np.arange(len(area)), random.poisson(SAMPLES * area))
        u, v = random.random((2, len(chosen), 1), dtype=np.float32)
        u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
        weights = np.concatenate([1 - u - v, u, v], 1)[:, :, None]
        corners = self.triangles[chosen]
        return (weights * self.vertices[corners]).sum(1), (weights * self.colors[corners]).sum(1)

    def drawn(self, camera, pose):
        K = pixel_corners(camera)
        rays = self.scene.create_rays_pinhole(K, np.linalg.inv(pose), camera.width, camera.height)
        hit = self.scene.cast_rays(rays)
        direction = array(rays)[..., 3:] @ pose[:3, 2]  # length along the optical axis of one unit of the ray
        distance, triangle = array(hit["t_hit"]), array(hit["primitive_ids"]).astype(np.int64)
        found = np.isfinite(distance)
        uv, color = array(hit["primitive_uvs"])[found], np.zeros((*distance.shape, 3), np.float32)
        weights = np.stack([1 - uv.sum(1), uv[:, 0], uv[:, 1]], 1)[:, :, None]
        color[found] = self.colors_at(self.triangles[triangle[found]], weights)
        return np.where(found, distance * direction, 0), color

    def colors_at(self, corners, weights):
        return (weights * self.colors[corners]).sum(1)


class TexturedMap(MeshMap):
    """Stillmap's mesh.glb: triangles, vertices, their places in the texture, and the texture are its four views of bytes."""

    def __init__(self, file):
        content = file.read_bytes()
        size = int.from_bytes(content[12:16], "little")
        views = json.loads(content[20:20 + size])["bufferViews"]
        parts = [content[28 + size + view["byteOffset"]:][:view["byteLength"]] for view in views]
        self.set_surface(np.frombuffer(parts[1], np.float32).reshape(-1, 3), np.frombuffer(parts[0], np.uint32).reshape(-1, 3))
        self.places = np.frombuffer(parts[2], np.float32).reshape(-1, 2)
        self.image = imread(io.BytesIO(parts[3])).astype(np.float32) / 255
        self.colors = np.zeros_like(self.vertices)  # of samples, whose places are judged

    def colors_at(self, corners, weights):
        x, y = (weights * self.places[corners]).sum(1).T * np.array(self.image.shape[1::-1])[:, None] - 0.5
        return np.stack([ndimage.map_coordinates(self.image[:, :, c], [y, x], order=1, mode="nearest") for c in range(3)], 1)


def maps_of(run, recording, pairs):
    """Returns the maps by their names."""
    cloud = o3d.t.io.read_point_cloud(str(run / "cloud.ply"))
    points, mesh = integrated(recording, pairs)
    return {"Stillmap `cloud.ply`": PointMap(array(cloud.point["positions"]), colors_of(cloud.point)),
            "Stillmap `mesh.ply`": MeshMap(o3d.t.io.read_triangle_mesh(str(run / "mesh.ply"))),
            "Stillmap `mesh.glb`": TexturedMap(run / "mesh.glb"),
            "Open3D points": PointMap(array(points.point["positions"]), colors_of(points.point)),
            "Open3D mesh": MeshMap(mesh)}


# --------------------------------------------------------------------------------------------------------- measures


def write_points(file, points, colors):
    cloud = o3d.t.geometry.PointCloud(np.ascontiguousarray(points, np.float32))
    cloud.point["colors"] = o3d.core.Tensor(np.clip(255 * colors + 0.5, 0, 255).astype(np.uint8))
    o3d.t.io.write_point_cloud(str(file), cloud)


def judged(program, sequence, run, file, surface):
    """Returns the figures of `stillmap eval --cloud`; {} without masks of a simulated sequence."""
    if not (sequence / "mask").is_dir():
        return {}
    words = ["--surface", surface] if surface else []
    result = file.with_suffix(".json")
    core.call([program, "eval", sequence / "groundtruth.txt", run / "trajectory.txt", "--cloud", file, "--sequence", sequence,
               "--json", result, "--force", *words], file.with_suffix(".log"))
    return core.read_json(result)


def fitted(drawn, image, where):
    """Returns the drawn colors times the gain per channel that fits the image best at the given pixels."""
    a, b = drawn[where], image[where]
    return np.clip(drawn * ((a * b).sum(0) / np.maximum((a * a).sum(0), 1e-9)), 0, 1)


def compared(drawn, image, where):
    """Returns squared error and structural similarity of the pixels."""
    shown = np.where(where[..., None], fitted(drawn, image, where), image).astype(np.float32)
    _, similarity = structural_similarity(shown, image, channel_axis=2, data_range=1, full=True)
    return ((shown - image)[where] ** 2).mean(), similarity[where].mean()


def appearance(maps, recording, pairs, out):
    """Returns PSNR, SSIM, share of pixels drawn, and share of depths explained of each map over the frames left out."""
    rows = {name: [] for name in maps}
    for number, (rgb, depth, static, pose) in enumerate(recording.frames(pairs)):
        image = rgb.astype(np.float32) / 255
        drawn = {name: each.drawn(recording.camera, pose) for name, each in maps.items()}
        both = static & np.all([z > 0 for z, _ in drawn.values()], 0)
        measured = (depth > 0) & (depth < FARTHEST)
        if both.sum() < 1000:
            continue
        for name, (z, color) in drawn.items():
            near = np.abs(z - depth) < np.maximum(2 * depth_sigma(depth), 0.01)
            rows[name].append([*compared(color, image, both), (z[static] > 0).mean(), near[measured].mean()])
        if number % 8 == 0:
            side = [image, *(color for _, color in drawn.values())]
            picture = np.clip(255 * np.concatenate(side, 1), 0, 255).astype(np.uint8)
            o3d.io.write_image(str(out / f"drawn_{number:03}.jpg"), o3d.geometry.Image(np.ascontiguousarray(picture)))
    figures = {}
    for name, values in rows.items():
        error, similarity, share, explained = np.mean(values, 0) if values else [np.nan] * 4
        figures[name] = {"psnr_db": -10 * np.log10(error), "ssim": similarity, "drawn": share, "explained": explained}
    return figures


def planes_of(points, up):
    """Returns the largest horizontal plane below the others' middle and up to four large vertical ones: normal, offset."""
    rest, planes = points[:: max(1, len(points) // 200000)], {"floor": [], "walls": []}
    o3d.utility.random.seed(1)
    for _ in range(12):
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(rest))
        plane, inliers = cloud.segment_plane(0.03, 3, 2000)
        if len(inliers) < 0.02 * len(points[:: max(1, len(points) // 200000)]):
            break
        lean, found = abs(plane[:3] @ up), rest[inliers]
        if lean > 0.98 and np.mean(rest @ up > (found @ up).mean() - 0.05) > 0.95:
            planes["floor"] = planes["floor"] or [plane]
        elif lean < 0.17 and len(planes["walls"]) < 4:
            planes["walls"].append(plane)
        rest = np.delete(rest, inliers, 0)
    return planes


def patch_thickness(points, plane, side=0.4, reach=0.12, fewest=60):
    """Yields the thickness of each patch of a plane [m]: 5 to 95 % of the distances from the patch's own plane."""
    normal, offset = plane[:3], plane[3]
    near = points[np.abs(points @ normal + offset) < reach]
    across = np.linalg.svd(normal[None])[2][1:]
    patches, which = np.unique(np.floor(near @ across.T / side).astype(int), axis=0, return_inverse=True)
    for i in range(len(patches)):
        patch = near[which.ravel() == i]
        if len(patch) < fewest:
            continue
        axes = np.linalg.svd(np.cov((patch - patch.mean(0)).T))[0]
        if abs(axes[:, 2] @ normal) > 0.97:
            yield np.subtract(*np.percentile((patch - patch.mean(0)) @ axes[:, 2], [95, 5]))


def thickness(points, planes):
    """Returns the median thickness of the patches of some planes [mm]; None without a patch."""
    patches = [t for plane in planes for t in patch_thickness(points, plane)]
    return 1000 * float(np.median(patches)) if patches else None


def measure(sequence, arguments):
    """Returns the figures of all maps of a sequence."""
    out = arguments.out / sequence.name
    out.mkdir(parents=True, exist_ok=True)
    mapped, left_out = split(sequence, out)
    run, masks, simulated = out / "run", sequence / "mask", (sequence / "mask").is_dir()
    words = ["--associations", mapped, "--mesh=ply,glb", "--planner", *(["--masks", masks] if simulated else [])]
    command = core.run_command(arguments.program, sequence, run, words, None if simulated else arguments.model)
    core.ensure_run(sequence.name, command, run)
    if not simulated and arguments.model:
        masks = out / "masks"
        if not masks.is_dir():
            core.call([arguments.lab_program, "masks", sequence, masks, "--model", arguments.model], out / "masks.log")
    recording = Recording(sequence, run, masks, 0 if simulated else WIDENED)
    core.say(f"{sequence.name}: Open3D ...")
    maps = maps_of(run, recording, mapped)
    shown = appearance(maps, recording, left_out, out)
    up = core.read_json(run / "floor.json").get("up")
    planes = planes_of(maps["Open3D points"].points.astype(float), np.array(up)) if up else {}
    rows = []
    for number, (name, each) in enumerate(maps.items()):
        points, colors = each.samples()
        file = out / f"points_{number}.ply"
        write_points(file, points, colors)
        rows.append({"sequence": sequence.name, "map": name, "points": len(points), **shown[name],
                     **{f"{kind}_mm": thickness(points, found) for kind, found in planes.items()},
                     "eval": judged(arguments.program, sequence, run, file, arguments.surface)})
    return rows


def cells_of(row):
    """Returns the line of the table for the figures of a map."""
    def scaled(factor, digits, group, name):
        value = core.leaf(row["eval"], group, name)
        return core.cell(None if value is None else factor * value, digits)

    def surface(factor, digits, *names):
        return [scaled(factor, digits, "surface", name) for name in names]
    return [row["sequence"], row["map"], row["points"], scaled(1, 0, "ghosts", "ghosts"),
            ", ".join(surface(1000, 1, "distance_median", "distance_p95")), *surface(100, 3, "stray_share"),
            "; ".join(surface(100, 1, "complete_2cm", "complete_5cm")), scaled(100, 1, "ghosts", "surface_share"),
            core.cell(row["psnr_db"], 2), core.cell(row["ssim"], 3), core.cell(100 * row["drawn"], 1),
            core.cell(100 * row["explained"], 1), core.cell(row.get("floor_mm"), 1), core.cell(row.get("walls_mm"), 1)]


def add_arguments(parser):
    parser.add_argument("sequences", type=Path, nargs="+", help="sequences in TUM layout")
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")
    parser.add_argument("--model", type=Path, help="network (.onnx) for sequences without mask/")
    parser.add_argument("--surface", type=Path, help="points of the true surface (.ply); default: surface.ply of a sequence")
    parser.add_argument("--program", type=Path, default=core.PROGRAM, help="default: %(default)s")
    parser.add_argument("--lab-program", type=Path, default=core.LAB_PROGRAM, help="default: %(default)s")


def main(arguments):
    if np is None:
        raise core.Failed(f"{MISSING} is missing: {__doc__.strip().splitlines()[-1].removeprefix('Needs: ')}; then run "
                          "build/surface_venv/bin/python -m lab surface ...")
    rows = [row for sequence in arguments.sequences for row in measure(sequence, arguments)]
    table = core.markdown(HEAD, [cells_of(row) for row in rows])
    core.write_tables(arguments.out, table, {"rows": rows})
    print(table)
    return 0

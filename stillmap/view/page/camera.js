// SPDX-License-Identifier: Apache-2.0
// The camera of the run: its path, its keyframes and loops, and where it is now.
import { on, send, setCount, state } from './page.js';
import { indexAt, LOST, lower, path, pathLength, pointAt, poseAt, pushFrame, setPath, STATES } from './path.js';
import { color, empty, layers, linesOf, orbit, orbitCamera, redraw, setLines, view, world } from './scene.js';

export let intrinsics = { width: 640, height: 480, fx: 525, fy: 525, cx: 320, cy: 240 };

// Returns the corners of the image at a depth, in the camera frame.
function corners(depth) {
  const { width, height, fx, fy, cx, cy } = intrinsics;
  return [[0, 0], [width, 0], [width, height], [0, height]].map(([u, v]) => [(u - cx) / fx * depth, (v - cy) / fy * depth, depth]);
}
function frustumEdges(depth) {
  const c = corners(depth), o = [0, 0, 0];
  return [o, c[0], o, c[1], o, c[2], o, c[3], c[0], c[1], c[1], c[2], c[2], c[3], c[3], c[0]].flat();
}

// ---------------------------------------------------------------------------------------------- path and map
export const pathPoint = (i) => new THREE.Vector3(...pointAt(i));
export const pathRotation = (i) => new THREE.Quaternion(...poseAt(i).subarray(3));
export function drawPath() {
  const shades = STATES.map((name) => color(name === 'tracked' ? 'accent' : name)), points = new Float32Array(3 * path.n), colors = new Float32Array(3 * path.n);
  for (let i = 0; i < path.n; ++i) {
    points.set(path.p.subarray(7 * i, 7 * i + 3), 3 * i);
    shades[path.s[i]].toArray(colors, 3 * i);
  }
  setLines(layers.path, points, { width: 3, strip: true, colors });
  state.path = path.n;
  setCount('path', path.n ? pathLength().toFixed(1) + ' m' : '');
  redraw();
}

let map = { keyframes: [], events: [] };
function drawMap() {
  const pattern = frustumEdges(0.11), edges = [], p = new THREE.Vector3(), q = new THREE.Quaternion();
  for (const pose of map.keyframes) {
    q.set(...pose.slice(3));
    for (let i = 0; i < pattern.length; i += 3) {
      p.fromArray(pattern, i).applyQuaternion(q);
      edges.push(p.x + pose[0], p.y + pose[1], p.z + pose[2]);
    }
  }
  setLines(layers.keyframes, edges, { shade: color('dim'), opacity: 0.75, width: 1 });
  // A loop joins the places of the camera at the two times.
  const loops = map.events.map((event) => [event.seen_in, lower(path.t, path.n, event.t)]).filter((ends) => Math.max(...ends) < path.n);
  setLines(layers.loops, loops.flat().flatMap(pointAt), { shade: color('loop') });
  redraw();
}

// ---------------------------------------------------------------------------------------------- now
export const eye = new THREE.Group();
world.add(eye);
const texture = new THREE.Texture();
texture.minFilter = THREE.LinearFilter;
texture.generateMipmaps = false;
texture.flipY = false;
let eyeLines = null, eyeImage = null;
function makeEye() {
  empty(eye);
  eyeLines = linesOf(frustumEdges(0.45));
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(corners(0.45).flat()), 3));
  geometry.setAttribute('uv', new THREE.BufferAttribute(new Float32Array([0, 0, 1, 0, 1, 1, 0, 1]), 2));
  geometry.setIndex([0, 1, 2, 0, 2, 3]);
  eyeImage = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ map: texture, side: THREE.DoubleSide, transparent: true, opacity: 0.85 }));
  eyeImage.visible = false;
  eyeImage.frustumCulled = false;
  eye.add(eyeLines, eyeImage);
  eye.visible = false;
}
// Shows an image in the frustum of the camera; null: none.
export function setEyeImage(image) {
  eyeImage.visible = Boolean(image);
  if (!image) return;
  texture.image = image;
  texture.needsUpdate = true;
  redraw();
}
// Shows the camera in a pose.
function placeEye(pose, s) {
  eye.visible = true;
  eye.position.fromArray(pose);
  eye.quaternion.fromArray(pose, 3);
  eyeLines.material.color.copy(color(s === LOST ? 'lost' : 'relocalized'));
  send('eye-moved');
  redraw();
}
// Shows the camera at a time of a finished run.
export function placeEyeAt(t) { placeEye(poseAt(indexAt(t)), path.s[indexAt(t)]); }

const sight = new THREE.Vector3(), seat = new THREE.Vector3();
let followed = 0;  // time of the last step [ms]
// Moves the camera of the view behind that of the run.
export function follow() {
  const now = performance.now(), weight = 1 - Math.exp(-Math.min(200, now - followed) / 160);
  followed = now;
  if (view.name !== 'follow' || !eye.visible) return;
  eye.updateMatrixWorld(true);
  seat.set(0, -0.75, -2.3).applyMatrix4(eye.matrixWorld);
  sight.set(0, 0.1, 2.5).applyMatrix4(eye.matrixWorld);
  if (orbitCamera.position.distanceTo(seat) + orbit.target.distanceTo(sight) < 2e-3) return;
  orbitCamera.position.lerp(seat, weight);
  orbit.target.lerp(sight, weight);
  orbitCamera.lookAt(orbit.target);
  redraw();
}

on('run', (message) => {
  intrinsics = message.camera;
  makeEye();
});
on('frame', ({ t, pose, state: s }) => {
  if (pose && (!path.n || t > path.t[path.n - 1])) pushFrame(t, pose, s);
  if (pose) placeEye(pose, s);
  else if (path.n) placeEye(poseAt(path.n - 1), LOST);
});
on('path', (message) => {
  setPath(message, state.live);
  drawPath();
});
on('map', (message) => {
  map = message;
  drawMap();
  const loops = map.events.filter((event) => event.kind !== 'dropped').length;
  state.keyframes = map.keyframes.length;
  setCount('keyframes', state.keyframes);
  setCount('loops', loops);
});
on('themed', () => { drawPath(); drawMap(); });
makeEye();

// SPDX-License-Identifier: Apache-2.0
// The floor and the upward direction; the view of the whole map, the cut at a height, and the floor grid.
import { $, on, send, state } from './page.js';
import { pathPoint, pathRotation } from './camera.js';
import { setColorHeight, setCutHeight, someMapPoints } from './cloud.js';
import { path } from './path.js';
import { above, arrange, color, empty, layers, orbit, orbitCamera, redraw, tangent, topCamera, view, world } from './scene.js';

const UP_FROM = {
  rules: 'Up is that of the file of rules.',
  run: 'Up is what was given to the run, or its floor.json.',
  floor: 'Up is that of the floor that was found in the map.',
  images: 'Up is a guess after walls and horizontal surfaces, or else the images, for no floor is certain. The grid, the top view and drawn zones may be tilted. Give --zones FILE with up, or --planner --up X,Y,Z to the run.',
};
export const ground = { up: [0, -1, 0], floor: -1.5, ceiling: 3, known: false };

function setGround({ up, floor, up_from: from }) {
  Object.assign(ground, { up, floor });
  state.up = up;
  state.upFrom = from;
  $('guess').hidden = from !== 'images';
  $('guess').title = UP_FROM.images;
  for (const id of ['n-grid', 'n-floor']) $(id).parentElement.title = `${UP_FROM[from]} up: [${up.join(', ')}]`;
  world.quaternion.setFromUnitVectors(new THREE.Vector3(...up), new THREE.Vector3(0, 1, 0));
  world.position.set(0, -floor, 0);
  world.updateMatrixWorld(true);
  const first = !ground.known;
  ground.known = true;
  setHeights();
  if (first || !view.touched) fit();
  send('grounded');
}

// Returns some points of the camera's path, with the floor at y = 0.
function somePathPoints() {
  const list = [];
  for (let i = path.n - 1; i >= 0; i -= Math.max(1, Math.floor(path.n / 500))) list.push(pathPoint(i).applyMatrix4(world.matrixWorld));
  return list;
}
const orDefault = (points) => (points.length ? points : [new THREE.Vector3(-2, 0, -2), new THREE.Vector3(2, 2, 2)]);
// Fits the colors of heights, the cut and the grid to the map.
function setHeights() {
  const box = new THREE.Box3().setFromPoints(orDefault(somePathPoints().concat(someMapPoints())));
  ground.ceiling = Math.max(2, box.max.y);
  const highest = Math.min(6, ground.ceiling);
  setColorHeight(highest);
  $('heights-top').textContent = (highest < ground.ceiling ? '> ' : '') + highest.toFixed(1) + ' m';
  setCut();
  const side = 2 * Math.ceil(Math.max(6, Math.abs(box.min.x), box.max.x, Math.abs(box.min.z), box.max.z));
  if (layers.grid.side !== side) drawGrid(side);
}
function drawGrid(side) {
  empty(layers.grid);
  const grid = new THREE.GridHelper(side, side <= 120 ? side : side / 10, color('dim'), color('dim'));
  Object.assign(grid.material, { transparent: true, opacity: 0.22, depthWrite: false });
  layers.grid.add(grid);
  layers.grid.side = side;
}
// Hides what is above a share of the ceiling's height; 1: nothing.
function setCut(share = Number($('cut').value)) {
  $('cut').value = share;
  setCutHeight(share >= 1 ? 1e9 : share * ground.ceiling);
  $('cut-value').textContent = share >= 1 ? 'off' : (share * ground.ceiling).toFixed(1) + ' m';
  redraw();
}
// Cuts the ceiling off in the top view only.
export function cutFor(name) {
  const share = Number($('cut').value);
  if (name === 'top' && share >= 1 && ground.ceiling > 2.2) setCut(1.9 / ground.ceiling);
  if (name !== 'top' && share < 1) setCut(1);
}

// Returns the direction from the map to the viewer: behind the first camera, obliquely from above.
function directionOfView() {
  const ahead = path.n ? new THREE.Vector3(0, 0, 1).applyQuaternion(pathRotation(0)).applyQuaternion(world.quaternion) : new THREE.Vector3(0, 0, -1);
  ahead.y = 0;
  if (ahead.length() < 0.1) ahead.set(0, 0, -1);
  return ahead.normalize().multiplyScalar(-0.85).applyAxisAngle(new THREE.Vector3(0, 1, 0), 0.45).setY(0.75).normalize();
}
// Shows the map up to 3 m above the floor, and the whole path of the camera, beside the panels.
export function fit() {
  const [freeWidth, freeHeight] = arrange(), way = somePathPoints(), map = someMapPoints(), low = map.filter((p) => p.y > -0.5 && p.y < 3);
  const points = orDefault(way.concat(low.length ? low : map));
  const box = new THREE.Box3().setFromPoints(points), center = box.getCenter(new THREE.Vector3()), size = box.getSize(new THREE.Vector3());
  const towards = directionOfView(), right = new THREE.Vector3(0, 1, 0).cross(towards).normalize(), upward = towards.clone().cross(right);
  const high = tangent() * freeHeight, wide = high / freeHeight * orbitCamera.aspect * freeWidth;
  const distances = (list) => list.map((p) => {
    const v = p.clone().sub(center);
    return v.dot(towards) + Math.max(Math.abs(v.dot(right)) / wide, Math.abs(v.dot(upward)) / high);
  }).sort((a, b) => a - b);
  const most = distances(points.slice(way.length));  // loose points far outside may be left out
  const far = Math.max(2, ...distances(way), most[Math.floor(0.99 * (most.length - 1))] || 0);
  orbit.target.copy(center);
  orbitCamera.position.copy(center).addScaledVector(towards, far);
  orbitCamera.near = Math.max(0.02, far / 900);
  orbitCamera.far = Math.max(100, far * 20);
  orbitCamera.updateProjectionMatrix();
  orbit.update();
  above.target.copy(center).setY(0);
  topCamera.position.copy(center).setY(200);
  topCamera.zoom = (topCamera.top - topCamera.bottom) / Math.max(2, size.z / freeHeight, size.x / freeWidth / Math.max(0.2, orbitCamera.aspect));
  topCamera.updateProjectionMatrix();
  above.update();
  redraw();
}

let flights = 0;
// Moves the view within 0.4 s to a place of the world, so that a sphere of a radius [m] around it is seen well.
export function flyTo(place, radius) {
  const controls = view.name === 'top' ? above : orbit, eye = controls.object, flight = flights += 1, begin = performance.now();
  const target = world.localToWorld(new THREE.Vector3(...place)), offset = eye.position.clone().sub(controls.target);
  if (controls === orbit) offset.setLength(1.3 * radius / tangent());
  const from = [controls.target.clone(), eye.position.clone()], to = [target, target.clone().add(offset)];
  const step = () => {
    const share = Math.min(1, (performance.now() - begin) / 400);
    controls.target.lerpVectors(from[0], to[0], share);
    eye.position.lerpVectors(from[1], to[1], share);
    controls.update();
    redraw();
    if (share < 1 && flight === flights) requestAnimationFrame(step);
  };
  view.touched = true;
  step();
}

$('cut').addEventListener('input', () => setCut());
on('map', (message) => { if (message.up) setGround(message); });
on('map-changed', setHeights);
on('themed', () => drawGrid(layers.grid.side));
on('run', () => { ground.known = false; });
setHeights();

// SPDX-License-Identifier: Apache-2.0
// Floor, obstacles and free space of the files for planners. Their frame `map` has z up, and its floor is z = 0.
import { on, setCount, state } from './page.js';
import { forEachRun } from './messages.js';
import { addLines, boxEdges, color, empty, layers, redraw } from './scene.js';

const FREE = 1, OCCUPIED = 2;  // values of cells
const drawn = [layers.floor, layers.obstacles, layers.free];
let planner = null;

function rectangleEdges([x, y], width, depth) {
  const corners = [[x, y, 0], [x + width, y, 0], [x + width, y + depth, 0], [x, y + depth, 0]];
  return corners.flatMap((corner, i) => [...corner, ...corners[(i + 1) % 4]]);
}
// Returns the lines at whole meters in a rectangle.
function meterLines([x, y], width, depth) {
  const lines = [];
  for (let k = Math.ceil(x); k <= x + width; ++k) lines.push(k, y, 0, k, y + depth, 0);
  for (let k = Math.ceil(y); k <= y + depth; ++k) lines.push(x, k, 0, x + width, k, 0);
  return lines;
}
const obstacleEdges = ({ center, size, yaw }) => boxEdges({ center, size, axes: [[Math.cos(yaw), Math.sin(yaw), 0], [-Math.sin(yaw), Math.cos(yaw), 0], [0, 0, 1]] });
// Returns the cells of a value as one image on the floor. The first row of the grid has the highest y.
function cellsOf({ width, height, resolution, origin, cells }, value, shade, opacity) {
  const image = new Uint8Array(4 * width * height), ink = [...shade.toArray().map((x) => Math.round(255 * x)), 255];
  forEachRun(cells, value, (first, count) => {
    for (let k = first; k < first + count; ++k) image.set(ink, 4 * ((height - 1 - Math.floor(k / width)) * width + k % width));
  });
  const texture = new THREE.DataTexture(image, width, height, THREE.RGBAFormat);
  texture.needsUpdate = true;
  const material = new THREE.MeshBasicMaterial({ map: texture, transparent: true, opacity, side: THREE.DoubleSide, depthWrite: false });
  const mesh = new THREE.Mesh(new THREE.PlaneBufferGeometry(width * resolution, height * resolution), material);
  mesh.position.set(origin[0] + width * resolution / 2, origin[1] + height * resolution / 2, 0.01);
  return mesh;
}
function draw() {
  drawn.forEach(empty);
  state.planner = Boolean(planner);
  redraw();
  if (!planner) return;
  const { grid, obstacles, T_map_world: T } = planner, width = grid.width * grid.resolution, depth = grid.height * grid.resolution;
  const turn = new THREE.Quaternion().fromArray(T, 3).conjugate(), place = new THREE.Vector3().fromArray(T).negate().applyQuaternion(turn);
  for (const layer of drawn) {
    layer.quaternion.copy(turn);
    layer.position.copy(place);
  }
  addLines(layers.floor, rectangleEdges(grid.origin, width, depth), { shade: color('dim'), width: 2 });
  addLines(layers.floor, meterLines(grid.origin, width, depth), { shade: color('dim'), opacity: 0.4, width: 1 });
  layers.obstacles.add(cellsOf(grid, OCCUPIED, color('obstacle'), 0.6));
  addLines(layers.obstacles, obstacles.flatMap(obstacleEdges), { shade: color('obstacle') });
  layers.free.add(cellsOf(grid, FREE, color('good'), 0.3));
  let free = 0;
  forEachRun(grid.cells, FREE, (first, count) => { free += count; });
  setCount('floor', `${width.toFixed(1)} × ${depth.toFixed(1)} m`);
  setCount('obstacles', obstacles.length);
  setCount('free', (free * grid.resolution ** 2).toFixed(1) + ' m²');
}

on('planner', (message) => {
  planner = message.grid ? message : null;
  draw();
});
on('themed', draw);

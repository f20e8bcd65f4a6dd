// SPDX-License-Identifier: Apache-2.0
// Zones, and points that move with the camera with the distances of their rules.
import { css, on, setCount, state } from './page.js';
import { eye } from './camera.js';
import { ground } from './ground.js';
import { addLines, color, dropLabels, empty, layers, linesOf, redraw, setLabel } from './scene.js';

let alarms = { zones: new Set(), rules: new Set(), unseen: new Set() };

// ---------------------------------------------------------------------------------------------- zones
let given = [];  // the zones of the run
export const drawn = [];  // those drawn on the page
export const zones = () => given.concat(drawn);
export function addZone(zone) {
  drawn.push(zone);
  drawZones();
}
function drawZone(zone, k) {
  const at = (p, h) => p.map((x, i) => x + zone.up[i] * h), [low, high] = zone.height, edges = [], faces = [];
  zone.polygon.forEach((p, i) => {
    const next = zone.polygon[(i + 1) % zone.polygon.length], a = at(p, low), b = at(next, low), c = at(next, high), d = at(p, high);
    edges.push(...a, ...b, ...d, ...c, ...a, ...d);
    faces.push(...a, ...b, ...c, ...a, ...c, ...d);
  });
  const shade = color(alarms.zones.has(zone.name) ? 'lost' : 'zone'), unseen = alarms.unseen.has(zone.name);
  addLines(layers.zones, edges, { shade, onTop: true });
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(faces), 3));
  const mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ color: shade, transparent: true, opacity: unseen ? 0.03 : 0.13, side: THREE.DoubleSide, depthWrite: false }));
  mesh.frustumCulled = false;
  layers.zones.add(mesh);
  const center = zone.polygon.reduce((sum, p) => sum.map((x, i) => x + p[i] / zone.polygon.length), [0, 0, 0]);
  setLabel('zones:' + k, at(center, high), unseen ? [zone.name, 'not in view'] : [zone.name], css('zone'), 'object');
}
function drawZones() {
  empty(layers.zones);
  dropLabels('zones');
  zones().forEach(drawZone);
  state.zones = zones().length;
  setCount('zones', state.zones);
  redraw();
}

// ---------------------------------------------------------------------------------------------- points
let points = [];
// Returns a ring; around the x or z axis if `turn` says so.
function ring(radius, turn) {
  const circle = [...Array(65).keys()].flatMap((i) => [radius * Math.cos(i * Math.PI / 32), 0, radius * Math.sin(i * Math.PI / 32)]);
  const line = linesOf(circle, { strip: true, opacity: turn ? 0.25 : 0.6 });
  line.rotation.set(turn === 'x' ? Math.PI / 2 : 0, 0, turn === 'z' ? Math.PI / 2 : 0);
  return line;
}
const cross = (r) => linesOf([-r, 0, 0, r, 0, 0, 0, -r, 0, 0, r, 0, 0, 0, -r, 0, 0, r]);
// A distance is a sphere, or a cylinder if it is level, with a ring on the floor and a plumb line. 0 m: the point alone.
function drawPoint(point) {
  const group = new THREE.Group(), below = new THREE.Group(), plumb = linesOf([0, 0, 0, 0, 1, 0], { opacity: 0.6 });
  group.add(cross(0.12), ring(point.nearer));
  below.add(ring(point.nearer), cross(0.12));
  group.add(...(point.level ? [below, plumb] : [ring(point.nearer, 'x'), ring(point.nearer, 'z')]));
  layers.points.add(group);
  return { ...point, group, below, plumb };
}
function placePoints() {
  const up = new THREE.Vector3(...ground.up);
  for (const point of points) {
    point.group.visible = eye.visible;
    if (!eye.visible) continue;
    point.group.position.set(...point.offset).applyQuaternion(eye.quaternion).add(eye.position);
    point.group.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), up);
    const height = up.dot(point.group.position) - ground.floor;
    point.below.position.set(0, -height, 0);
    point.plumb.scale.set(1, -height || 1e-3, 1);
    if (point.name !== 'camera') setLabel('points:' + point.rule, point.group.position.toArray(), [point.name, point.nearer ? point.nearer + ' m' : ''], css('zone'), 'object');
  }
  redraw();
}
function colorPoints() {
  for (const point of points) {
    const shade = color(alarms.rules.has(point.rule) ? 'lost' : 'zone');
    point.group.traverse((part) => { if (part.material) part.material.color.copy(shade); });
  }
  redraw();
}

on('zones', (message) => {
  given = message.zones;
  drawZones();
});
on('points', (message) => {
  empty(layers.points);
  dropLabels('points');
  points = message.points.map(drawPoint);
  setCount('rings', points.length);
  placePoints();
  colorPoints();
});
on('eye-moved', placePoints);
on('grounded', placePoints);
on('alarmed', (message) => {
  alarms = message;
  drawZones();
  colorPoints();
});
on('themed', () => { drawZones(); colorPoints(); });

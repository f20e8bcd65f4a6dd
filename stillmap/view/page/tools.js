// SPDX-License-Identifier: Apache-2.0
// Measuring between two points, and drawing zones.
import { $, element, state } from './page.js';
import { pointNear } from './cloud.js';
import { ground } from './ground.js';
import { addZone, drawn, zones } from './rules.js';
import { addLines, camera, color, empty, layers, orbit, redraw, view, world } from './scene.js';
import { vectorText, zonesYaml } from './text.js';

let tool = null, picked = [];
const caster = new THREE.Raycaster();
function rayAt(x, y) {
  caster.setFromCamera(new THREE.Vector2(2 * x / innerWidth - 1, 1 - 2 * y / innerHeight), camera());
  return caster.ray;
}
// Chooses a tool, "measure" or "zone", or ends it.
function setTool(name) {
  tool = tool === name ? null : name;
  forgetPicked();
  $('measure').classList.toggle('on', tool === 'measure');
  $('zone').classList.toggle('on', tool === 'zone');
  notice({ measure: 'Click two points.', zone: 'Click the corners on the floor, then Enter or Save.' }[tool] || '');
}
export function endTool() { if (tool) setTool(tool); }
function forgetPicked() {
  picked = [];
  empty(layers.measure);
  redraw();
}
function notice(text) {
  state.notice = text;
  $('measured-text').textContent = text;
  $('measured').hidden = !text;
  $('save').hidden = tool !== 'zone' || picked.length < 3;
}
function pick(x, y) {
  const ray = rayAt(x, y), point = tool === 'zone' ? ray.intersectPlane(new THREE.Plane(new THREE.Vector3(0, 1, 0), 0), new THREE.Vector3()) : pointNear(ray);
  if (!point) { notice('There is no point here.'); return; }
  if (tool === 'measure' && picked.length === 2) forgetPicked();
  picked.push(point);
  const material = new THREE.PointsMaterial({ size: 9, sizeAttenuation: false, color: color('relocalized'), depthTest: false });
  layers.measure.add(new THREE.Points(new THREE.BufferGeometry().setFromPoints([point]), material));
  if (picked.length > 1) addLines(layers.measure, picked.slice(-2).flatMap((p) => p.toArray()), { shade: color('relocalized'), width: 2.5, onTop: true });
  const place = `world frame: ${vectorText(world.worldToLocal(point.clone()).toArray(), 2)} m`;
  notice(tool === 'zone' ? `corner ${picked.length}, ${place}` : place);
  if (tool === 'measure' && picked.length === 2) {
    const [a, b] = picked;
    state.measured = a.distanceTo(b);
    notice(`${state.measured.toFixed(3)} m  (level ${Math.hypot(a.x - b.x, a.z - b.z).toFixed(3)} m, height ${Math.abs(a.y - b.y).toFixed(3)} m); ${place}`);
  }
  redraw();
}
export function saveZone() {
  if (tool !== 'zone' || picked.length < 3) return;
  let number = 1;
  while (zones().some((zone) => zone.name === 'zone ' + number)) number += 1;
  const name = 'zone ' + number;
  addZone({ name, polygon: picked.map((p) => world.worldToLocal(p.clone()).toArray()), height: [0, 2.5], up: ground.up });
  state.zoneYaml = zonesYaml(drawn, ground.up, state.upFrom === 'images');
  element('a', { href: URL.createObjectURL(new Blob([state.zoneYaml], { type: 'text/yaml' })), download: 'zones.yaml' }).click();
  setTool('zone');
  notice(`${name} is saved as zones.yaml among this browser's downloads${drawn.length > 1 ? `, with the other ${drawn.length - 1} drawn` : ''}. It takes effect with --zones zones.yaml.`);
}

let down = null;
$('canvas').addEventListener('pointerdown', (event) => { down = [event.clientX, event.clientY]; });
$('canvas').addEventListener('pointerup', (event) => {
  if (tool && down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) < 5) pick(event.clientX, event.clientY);
});
$('canvas').addEventListener('dblclick', (event) => {
  const point = tool || view.name !== 'orbit' ? null : pointNear(rayAt(event.clientX, event.clientY));
  if (point) { orbit.target.copy(point); orbit.update(); redraw(); }
});
$('measure').addEventListener('click', () => setTool('measure'));
$('zone').addEventListener('click', () => setTool('zone'));
$('save').addEventListener('click', saveZone);

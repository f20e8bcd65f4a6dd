// SPDX-License-Identifier: Apache-2.0
// Buttons and keys, light and dark, and which layers are offered.
import { $, isLight, send, state } from './page.js';
import { nextColors } from './cloud.js';
import { cutFor, fit } from './ground.js';
import { hasMovers } from './movers.js';
import { above, color, layers, orbit, orbitCamera, redraw, renderer, topCamera, view } from './scene.js';
import { play, step } from './timeline.js';
import { endTool, saveZone } from './tools.js';
import { stepWarning } from './warning_panel.js';

function setView(name) {
  const before = view.name;
  view.name = state.view = name;
  if (name === 'orbit' && before === 'follow') fitAgain();
  orbit.enabled = name === 'orbit';
  above.enabled = name === 'top';
  for (const button of document.querySelectorAll('[data-view]')) button.classList.toggle('on', button.dataset.view === name);
  cutFor(name);
  if (name === 'follow') { orbitCamera.near = 0.05; orbitCamera.updateProjectionMatrix(); }
  redraw();
}
function fitAgain() {
  view.touched = false;
  fit();
}
function setTheme(name) {
  document.documentElement.dataset.theme = name;
  renderer.setClearColor(color('back'));
  try { localStorage.setItem('theme', name); } catch (e) { /* private mode */ }
  send('themed');
  redraw();
}
function firstTheme() {
  const asked = new URLSearchParams(location.search).get('theme');
  try {
    return asked || localStorage.getItem('theme') || (matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark');
  } catch (e) {  // private mode
    return asked || 'dark';
  }
}
function turn(dx, dy) {
  const offset = orbitCamera.position.clone().sub(orbit.target), s = new THREE.Spherical().setFromVector3(offset);
  s.theta -= dx;
  s.phi = Math.min(3, Math.max(0.05, s.phi - dy));
  orbitCamera.position.copy(orbit.target).add(offset.setFromSpherical(s));
  orbit.update();
  view.touched = true;
  redraw();
}
function nearer(factor) {
  if (view.name === 'top') { topCamera.zoom *= factor; topCamera.updateProjectionMatrix(); } else { orbitCamera.position.sub(orbit.target).divideScalar(factor).add(orbit.target); orbit.update(); }
  view.touched = true;
  redraw();
}
const clicked = (id) => () => $(id).click();
const keys = {
  1: () => setView('orbit'), 2: () => setView('top'), 3: () => setView('follow'), f: fitAgain, m: clicked('measure'), z: clicked('zone'), c: nextColors,
  l: clicked('theme'), s: clicked('sound'), '?': clicked('help'), p: () => document.body.classList.toggle('bare'),
  n: () => stepWarning(1), b: () => stepWarning(-1), ' ': () => play(), ',': () => step(-1), '.': () => step(1), Escape: endTool, Enter: saveZone,
  ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, 0.08), ArrowDown: () => turn(0, -0.08), '+': () => nearer(1.15), '-': () => nearer(1 / 1.15),
};
addEventListener('keydown', (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || /SELECT|DIALOG/.test(event.target.tagName) || $('keys').open) return;
  if (event.target.tagName === 'INPUT' && /Arrow/.test(event.key)) return;
  const action = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (!action || (event.target.tagName === 'BUTTON' && /^( |Enter)$/.test(event.key))) return;
  event.preventDefault();
  action();
});
for (const button of document.querySelectorAll('[data-view]')) button.addEventListener('click', () => setView(button.dataset.view));
for (const box of document.querySelectorAll('[data-layer]')) box.addEventListener('change', () => { offerLayers(); redraw(); });
for (const button of document.querySelectorAll('[data-panel]')) {
  button.addEventListener('click', () => {
    for (const panel of document.querySelectorAll('.panel')) panel.classList.toggle('open', panel.id === button.dataset.panel && !panel.classList.contains('open'));
  });
}
$('fit').addEventListener('click', fitAgain);
$('theme').addEventListener('click', () => setTheme(isLight() ? 'dark' : 'light'));
$('help').addEventListener('click', () => { $('keys').showModal(); $('keys').scrollTop = 0; });

// Offers the layers for which there are data.
export function offerLayers() {
  const offered = { cloud: state.points > 0, movers: hasMovers(), grid: !state.planner };
  for (const box of document.querySelectorAll('[data-layer]')) {
    const name = box.dataset.layer, label = box.parentElement, keys = label.nextElementSibling;
    label.hidden = !(name in offered ? offered[name] : layers[name].children.length);
    layers[name].visible = box.checked && !label.hidden;
    if (keys && keys.className === 'keys') keys.hidden = label.hidden;
  }
}

// For measurements: turns the map.
let spinning = 0;
state.spin = (on) => {
  clearInterval(spinning);
  if (on) spinning = setInterval(() => turn(0.02, 0), 10);
};
setTheme(firstTheme());
setView('orbit');

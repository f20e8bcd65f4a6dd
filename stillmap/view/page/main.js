// SPDX-License-Identifier: Apache-2.0
// The page of the view: reads the messages that docs/view.md describes and draws them with three.js. Here: what is drawn when.
import { $, on, phone, state } from './page.js';
import { connect } from './connection.js';
import { above, arrange, camera, color, orbit, orbitCamera, picture, placeLabels, project, renderer, resizeScene, scene, tangent, topHeight, view } from './scene.js';
import { distribute, showLateChunks } from './cloud.js';
import './mesh.js';
import { drawPath, eye, follow } from './camera.js';
import './ground.js';
import './movers.js';
import './changes.js';
import './rules.js';
import './planner.js';
import { advance, drawMarks } from './timeline.js';
import './warning_panel.js';
import './frame_panel.js';
import { path } from './path.js';
import { offerLayers } from './controls.js';
import { countText } from './text.js';

// Points drawn while the picture changes: as many as take FRAME_MS, at least MIN_BUDGET. At rest more are added.
const MIN_BUDGET = 1e4, ENOUGH = 3e5, MAX_BUDGET = phone ? 3e6 : 2e7, FRAME_MS = 33, REST_MS = 300, SLOWEST_MS = 700;
const COARSEST = 0.5;  // least sharpness: share of the screen's pixels along each side

// ---------------------------------------------------------------------------------------------- sizes
function resize() {
  resizeScene();
  drawMarks();
  arrange();
}
addEventListener('resize', resize);
function placePanels() {
  document.documentElement.style.setProperty('--top', $('top').offsetHeight + 'px');
  const below = $('timeline').getBoundingClientRect();
  document.documentElement.style.setProperty('--bottom', Math.max(56, below.height ? innerHeight - below.top : 0) + 'px');
  arrange();
}
const sizes = new ResizeObserver(() => requestAnimationFrame(placePanels));  // in the next frame, since it resizes the panels
for (const id of ['top', 'layers', 'frame', 'timeline']) sizes.observe($(id));
function showScale() {
  const perMeter = innerHeight / (view.name === 'top' ? topHeight() : 2 * tangent() * Math.max(0.1, orbitCamera.position.distanceTo(orbit.target)));
  const wanted = 110 / perMeter, decade = 10 ** Math.floor(Math.log10(wanted)), length = [5, 2, 1].map((k) => k * decade).find((x) => x <= wanted);
  $('scale-bar').style.width = (length * perMeter) + 'px';
  $('scale-text').textContent = length >= 1 ? `${length} m` : `${Math.round(100 * length)} cm`;
}

// ---------------------------------------------------------------------------------------------- drawing
let last = 0;  // time of the last frame of the page [ms]
let drawnAt = 0, changedAt = 0, restBudget = 0, share = 1;
// Fits points and pixels to the time of the last frame [ms].
function adapt(spent) {
  if (spent > 1.15 * FRAME_MS) {
    const excess = Math.max(0.25, FRAME_MS / spent);
    if (state.sharpness > COARSEST) state.sharpness = Math.max(COARSEST, state.sharpness * Math.sqrt(excess));
    else state.budget = Math.max(MIN_BUDGET, Math.min(state.budget, state.drawn) * excess);
  } else if (spent < 0.8 * FRAME_MS) {
    if (share < 1 && (state.drawn < ENOUGH || state.sharpness === 1)) state.budget = Math.min(MAX_BUDGET, state.budget * 1.08);
    else state.sharpness = Math.min(1, state.sharpness * 1.05);
  }
}
function setSharpness(value) {
  const ratio = Math.min(devicePixelRatio, 2) * value;
  if (Math.abs(renderer.getPixelRatio() - ratio) > 0.02) renderer.setPixelRatio(ratio);
  picture.value.z = 1 / renderer.getPixelRatio();
}
// Returns the points to be drawn now; 0: nothing has to be drawn. While the picture changes, a frame has the points and pixels
// that take FRAME_MS. At rest it gets all pixels, and twice the points with each frame, until all are drawn or a frame has taken long.
function budgetNow(time) {
  if (!view.dirty && (state.rests || time - changedAt < REST_MS)) { drawnAt = 0; return 0; }
  const spent = drawnAt ? time - drawnAt : 0;
  drawnAt = time;
  if (view.dirty) {
    if (restBudget === 0 && spent) adapt(spent);
    changedAt = time;
    restBudget = 0;
    state.rests = false;
    return state.budget;
  }
  const complete = share >= 1 && (restBudget > 0 || state.sharpness === 1);
  state.rests = complete || 2 * spent > SLOWEST_MS || restBudget > MAX_BUDGET;
  restBudget = restBudget > 0 ? 2 * restBudget : state.budget;
  return state.rests ? 0 : restBudget;
}
function drawScene(budget) {
  if (state.live && path.n !== state.path) drawPath();
  if (restBudget === 0) offerLayers();
  view.dirty = false;
  setSharpness(restBudget === 0 ? state.sharpness : 1);
  scene.updateMatrixWorld();
  camera().updateMatrixWorld();
  share = distribute(budget);
  renderer.render(scene, camera());
  placeLabels();
  showScale();
  state.renders += 1;
}
function draw(time) {
  requestAnimationFrame(draw);
  showLateChunks(time);
  advance((time - last) / 1000);
  last = time;
  follow();
  countTraffic(time);
  const budget = budgetNow(time);
  if (budget) drawScene(budget);
}

// ---------------------------------------------------------------------------------------------- figures
let mapCost = '', second = { time: 0, renders: 0, bytes: 0 };  // since when, and the numbers then
on('cloud', ({ bytes, ms }) => { mapCost = `; map: ${(bytes / 1024).toFixed(0)} KiB, ${Math.round(ms)} ms`; });
function countTraffic(time) {
  const seconds = (time - second.time) / 1000, { renders, bytes } = state;
  if (seconds < 1) return;
  state.fps = (renders - second.renders) / seconds;
  $('traffic').textContent = state.connected ? `${((bytes - second.bytes) / 1024 / seconds).toFixed(0)} KiB/s, ${countText(state.drawn)} points drawn${mapCost}` : '';
  second = { time, renders, bytes };
}

// For tests: whether the camera of the run is in the picture; the pixel at which the target of the view is drawn; the share of the
// canvas that is not background.
state.eyeInView = () => {
  const { x, y, z } = project(eye.position);
  return eye.visible && z < 1 && Math.max(Math.abs(x), Math.abs(y)) < 1;
};
state.middle = () => {
  camera().updateMatrixWorld();
  const p = (view.name === 'top' ? above : orbit).target.clone().project(camera());
  return [(p.x + 1) / 2 * innerWidth, (1 - p.y) / 2 * innerHeight];
};
state.inked = () => {
  renderer.render(scene, camera());
  const gl = renderer.getContext(), { width, height } = gl.canvas, pixels = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  const back = color('back').toArray().map((x) => 255 * x);
  let inked = 0;
  for (let i = 0; i < pixels.length; i += 4) if (back.reduce((sum, x, k) => sum + Math.abs(pixels[i + k] - x), 0) > 24) inked += 1;
  return inked / (width * height);
};

resize();
connect();
requestAnimationFrame(draw);

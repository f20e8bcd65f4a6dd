// SPDX-License-Identifier: Apache-2.0
// The panel of the newest frame with its image, or of the results of a finished run.
import { $, element, narrow, on, state } from './page.js';
import { eye, intrinsics, setEyeImage } from './camera.js';
import { link } from './connection.js';
import { movers, shadeOf } from './movers.js';
import { indexAt, path } from './path.js';
import { cornerOf } from './scene.js';
import { findingText, msText, nameOf, percentText, untrusted } from './text.js';
import { boxDistance } from './warnings.js';

const STAGES = { features: '#4fa3ff', masks: '#b78cff', motion: '#ffb454', pose: '#43d17a' };
const FRAME_MS = 33;  // time of a frame of a camera
const WORDS = {
  tracking: 'time to track the newest frame; the median on a finished run', latency: 'time from the program to this page, by the clocks of both computers',
  coverage: 'share of the frames with a pose of the camera', waiting: 'time that the frame waited for a free thread',
  keypoints: 'points found in the image', moving: 'keypoints on moving objects', inliers: 'keypoints that agree with the pose of the camera',
  'mask age': 'age of the newest result of the network [frames]', 'no movers': 'frames whose moving objects were not looked for, since the computer was too slow',
  'no view': 'frames that were not added to the map, since the computer was too slow', 'fewer keyp.': 'frames with fewer keypoints, since the computer was too slow',
  dynamics: 'whether the scene is highly dynamic, so that keypoints on people are removed (preset gated-seg)', landmarks: 'points of the map that the camera is located with', keyframes: 'frames that the map is made of', loops: 'places that were recognized, which corrected the map',
  relocalized: 'frames in which a lost camera found its place again', maps: 'parts of the map that are not connected', 'ATE RMSE': 'absolute trajectory error against the true trajectory',
  preset: 'the set of options of the run', 'points drawn': 'points of the map in this picture; all are drawn when it rests',
};
$('words').replaceChildren(...Object.entries(WORDS).flatMap(([word, meaning]) => [element('dt', { textContent: word }), element('dd', { textContent: meaning })]));

// Shows rows [name, value, whether it is bad]; those without a value are left out.
function showStats(rows) {
  $('stats').replaceChildren(...rows.filter(([, value]) => value !== undefined).flatMap(([name, value, bad]) => {
    const title = WORDS[name] || '';
    return [element('span', { textContent: name, title }), element('b', { textContent: value, title, className: bad ? 'bad' : '' })];
  }));
}
const bars = Object.entries(STAGES).map(([name, shade]) => {
  const part = element('i'), patch = element('i'), text = element('span');
  part.style.background = patch.style.background = shade;
  return { name, part, text, key: element('span', {}, patch, text) };
});
function showTimes(ms) {
  if (!$('times').children.length) $('times').append(element('div', { className: 'bar' }, ...bars.map((bar) => bar.part)), element('div', { className: 'bar-keys' }, ...bars.map((bar) => bar.key)));
  const most = Math.max(FRAME_MS, bars.reduce((sum, { name }) => sum + ms[name], 0));
  for (const { name, part, text } of bars) {
    part.style.width = (100 * ms[name] / most) + '%';
    text.textContent = `${name} ${ms[name].toFixed(1)}`;
  }
}

let frames = null;  // length of the sequence; null: not known
on('run', (message) => {
  frames = message.frames;
  const tab = document.querySelector('[data-panel=frame]');
  $('frame').hidden = tab.hidden = ['map', 'cloud', 'changes'].includes(message.kind);
  $('frame-title').textContent = tab.textContent = message.live ? 'Frame' : 'Run';
});
on('frame', (message) => {
  const { ms, shed } = message, total = ms.features + ms.masks + ms.motion + ms.pose, coverage = message.tracked / (message.index + 1);
  $('clock').textContent = `frame ${message.index + 1}${frames ? ' of ' + frames : ''}`;
  $('reason').textContent = message.reason;
  showStats([
    ['tracking', msText(total), total > FRAME_MS], ['latency', msText(Math.max(0, link.latency))], ['coverage', percentText(coverage), coverage < 0.95],
    ['waiting', msText(ms.waiting)], ['keypoints', message.keypoints], ['moving', message.moving], ['inliers', message.inliers, message.inliers < 30],
    ['mask age', message.mask_age < 0 ? '–' : message.mask_age, message.mask_age > 10], ['dynamics', [undefined, 'low', 'high'][message.dynamics]],
    ['no movers', shed.without_movers, shed.without_movers > 0], ['no view', shed.without_view, shed.without_view > 0],
    ['fewer keyp.', shed.fewer_keypoints, shed.fewer_keypoints > 0],
  ]);
  showTimes(ms);
});
on('summary', ({ summary }) => {
  const { frames: { total, tracked, highly_dynamic: dynamic } = {}, evaluation, tracking_median_ms: median } = summary, coverage = tracked / total;
  showStats([
    ['frames', total], ['tracked', tracked], ['keyframes', summary.keyframes], ['landmarks', summary.landmarks], ['tracking', median === undefined ? median : msText(median)],
    ['maps', summary.maps, summary.maps > 1], ['loops', summary.loops && summary.loops.length], ['relocalized', summary.relocalizations && summary.relocalizations.length],
    ['coverage', coverage ? percentText(coverage) : undefined, coverage < 0.95],
    ['ATE RMSE', evaluation && evaluation.ate ? (100 * evaluation.ate.translation_m.rmse).toFixed(1) + ' cm' : undefined],
    ['dynamics', Number.isFinite(dynamic) ? `high ${Math.round(100 * dynamic / total)} %` : undefined], ['preset', summary.preset || undefined],
  ]);
  showFindings(untrusted(summary));
});
function showFindings(findings) {
  $('findings-title').hidden = !findings.length;
  $('findings').replaceChildren(...findings.map((finding) => element('p', { textContent: findingText(finding) })));
}

// ---------------------------------------------------------------------------------------------- image
let url = null;
function showImage(blob) {
  const old = url;
  url = URL.createObjectURL(blob);
  $('image').src = url;
  if (old) URL.revokeObjectURL(old);
  state.images += 1;
}
// Shows or hides the image, and says why there is none.
function setNoImage(reason) {
  state.noImage = reason;
  $('no-image').textContent = reason;
  $('figure').hidden = Boolean(reason);
  for (const keys of document.querySelectorAll('.image-keys')) keys.hidden = Boolean(reason) || !state.live;
  if (reason) setEyeImage(null);
}

// Asks for the image of a finished run at a time. While one is on its way, only the newest time is remembered.
let available = false, wanted = null, asking = false;
async function askImage(t) {
  wanted = path.t[indexAt(t)];
  if (asking || !available) return;
  asking = true;
  while (wanted !== null) {
    const query = new URLSearchParams(location.search);
    query.set('t', wanted);
    wanted = null;
    try {
      const answer = await fetch('/image?' + query);
      if (answer.ok) showImage(await answer.blob());
      setNoImage(answer.ok ? '' : await answer.text());
    } catch (e) {
      setNoImage('No image: no connection.');
    }
  }
  asking = false;
}

// Outlines the moving objects, with the numbers that they have on the map and in the warnings.
function drawBoxes() {
  const image = $('image'), { width, height } = intrinsics, shapes = [];
  const size = height / ($('figure').classList.contains('large') ? 40 : narrow.matches ? 15 : 22);
  const fits = image.naturalWidth && Math.abs(image.naturalWidth / image.naturalHeight * height / width - 1) < 0.02;
  $('boxes').setAttribute('viewBox', `0 0 ${width} ${height}`);
  state.boxes = [];
  for (const m of fits && eye.visible ? movers.values() : []) {
    const box = boxInImage(m), text = `${nameOf(m)}, ${boxDistance(m, eye.position.toArray()).toFixed(1)} m`;
    if (!box) continue;
    const [left, top, right, bottom] = box, shade = '#' + shadeOf(m.id).getHexString();
    shapes.push(svg('rect', { x: left, y: top, width: right - left, height: bottom - top, stroke: shade, 'stroke-dasharray': m.observed ? '' : '6 4' }));
    shapes.push(svg('text', { x: Math.min(left + 4, width - 9 * size), y: bottom - 6, 'font-size': size }, text));
    state.boxes.push(text);
  }
  $('boxes').replaceChildren(...shapes);
}
function svg(name, attributes, text = '') {
  const element = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.textContent = text;
  return element;
}
// Returns left, top, right and bottom of a box in the image; null if it is out of view.
function boxInImage({ min, max }) {
  const { width, height, fx, fy, cx, cy } = intrinsics, turn = eye.quaternion.clone().conjugate(), u = [], v = [];
  for (let k = 0; k < 8; ++k) {
    const p = new THREE.Vector3(...cornerOf(min, max, k)).sub(eye.position).applyQuaternion(turn), z = Math.max(0.1, p.z);
    if (p.z > 0) { u.push(cx + fx * p.x / z); v.push(cy + fy * p.y / z); }
  }
  if (!u.length) return null;
  const within = (x, most) => Math.min(most, Math.max(0, x));
  const box = [within(Math.min(...u), width), within(Math.min(...v), height), within(Math.max(...u), width), within(Math.max(...v), height)];
  return box[2] > box[0] && box[3] > box[1] ? box : null;
}

$('image').addEventListener('load', () => {
  setEyeImage($('image'));
  drawBoxes();
});
$('figure').addEventListener('click', () => {
  $('figure').classList.toggle('large');
  drawBoxes();
});
on('run', () => {
  available = false;
  setNoImage('');
  $('figure').style.aspectRatio = `${intrinsics.width} / ${intrinsics.height}`;
  $('figure').hidden = !state.live;
});
on('image', ({ jpeg, frame }) => {
  showImage(new Blob([jpeg], { type: 'image/jpeg' }));
  $('frame-number').textContent = frame;
});
on('images', ({ problem }) => {
  available = !problem;
  setNoImage(problem);
  if (path.n && state.time !== undefined) askImage(state.time);
});
on('timed', askImage);
on('movers-drawn', drawBoxes);
on('finished', () => setNoImage('No images after the end: stillmap view shows them.'));

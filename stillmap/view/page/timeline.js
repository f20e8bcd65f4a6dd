// SPDX-License-Identifier: Apache-2.0
// The time slider of a finished run, with rows of marks below it.
import { $, css, element, on, send, state } from './page.js';
import { placeEyeAt } from './camera.js';
import { firstTime, indexAt, lastTime, LOST, path } from './path.js';
import { redraw } from './scene.js';
import { addDynamics, rowsOf, textsBetween } from './time_rows.js';

const ROW = 10;  // height of a row [CSS pixels]
let playing = false, now = 0, rows = [];
let mapEvents = [], warnings = [], summary = {}, periods = [];

// A finished run is shown from its start; a run that was watched live stays at its end.
function setTimeline(t = $('timeline').hidden ? firstTime() : now) {
  $('timeline').hidden = !path.n || state.live;
  if ($('timeline').hidden) return;
  $('time').min = firstTime();
  $('time').max = lastTime();
  send('recorded');
  showTime(t);
  drawMarks();
}
function showTime(t) {
  now = state.time = Math.min(lastTime(), Math.max(firstTime(), t));
  placeEyeAt(now);
  $('time').value = now;
  $('time-value').textContent = `${(now - firstTime()).toFixed(1)} / ${(lastTime() - firstTime()).toFixed(1)} s`;
  $('clock').textContent = path.s[indexAt(now)] === LOST ? 'camera lost' : '';
  send('timed', now);
}
export const secondsText = (t) => `${(t - firstTime()).toFixed(1)} s`;
export const timeNow = () => now;
export function play(on = !playing) {
  if ($('timeline').hidden) return;
  playing = on;
  $('play').textContent = on ? '❚❚' : '▶';
  if (on && now >= lastTime() - 0.05) showTime(firstTime());
  redraw();
}
// Shows a time and stops there.
export function goTo(t) {
  if ($('timeline').hidden || t === undefined) return;
  play(false);
  showTime(t);
}
export const step = (frames) => goTo(path.t[Math.min(path.n - 1, Math.max(0, indexAt(now) + frames))]);
// Plays on. elapsed: since the last call [s]
export function advance(elapsed) {
  if (!playing || $('timeline').hidden) return;
  const next = now + Math.min(0.1, elapsed) * Number($('rate').value);
  if (next >= lastTime()) play(false);
  showTime(next);
}

export function drawMarks() {
  if ($('timeline').hidden || path.n < 2) return;
  rows = rowsOf({ path, mapEvents, warnings, summary, periods });
  $('rows').replaceChildren(...rows.map((row) => element('span', { textContent: row.name })));
  const canvas = $('marks'), ink = canvas.getContext('2d'), scale = devicePixelRatio, width = Math.max(100, canvas.clientWidth);
  canvas.style.height = rows.length * ROW + 'px';
  canvas.width = width * scale;
  canvas.height = rows.length * ROW * scale;
  ink.scale(scale, scale);
  const x = (t) => width * (t - firstTime()) / (lastTime() - firstTime());
  rows.forEach((row, k) => {
    for (const { begin, end, shade, faint } of row.marks) {
      ink.globalAlpha = faint ? 0.35 : 1;
      ink.fillStyle = css(shade);
      ink.fillRect(x(begin) - 1, k * ROW + 2, Math.max(2, x(end) - x(begin)), ROW - 3);
    }
  });
  state.rows = Object.fromEntries(rows.map((row) => [row.name, row.marks.length]));
}
// Describes the marks below the pointer, and returns its time.
function showHint(event) {
  const box = $('marks').getBoundingClientRect(), row = rows[Math.floor((event.clientY - box.top) / ROW)], near = 4;  // [pixels]
  const time = (x) => firstTime() + (x - box.left) / box.width * (lastTime() - firstTime()), texts = textsBetween(row, time(event.clientX - near), time(event.clientX + near));
  state.hint = texts.length ? [`${row.name}, ${secondsText(time(event.clientX))}`, ...texts].join('\n') : '';
  $('hint').textContent = state.hint;
  $('hint').hidden = !state.hint;
  $('hint').style.left = Math.min(innerWidth - $('hint').offsetWidth - 8, Math.max(8, event.clientX - $('hint').offsetWidth / 2)) + 'px';
  return time(event.clientX);
}

$('marks').addEventListener('pointermove', showHint);
$('marks').addEventListener('pointerleave', (event) => { if (event.pointerType === 'mouse') $('hint').hidden = true; });
$('marks').addEventListener('pointerdown', (event) => goTo(showHint(event)));
addEventListener('pointerdown', (event) => { if (event.target !== $('marks')) $('hint').hidden = true; });
$('time').addEventListener('input', () => goTo(Number($('time').value)));
$('play').addEventListener('click', () => play());
for (const type of ['path', 'tracks']) on(type, () => setTimeline());
on('events', (message) => {
  warnings = message.events;
  setTimeline();
});
on('map', (message) => {
  mapEvents = message.events;
  drawMarks();
});
on('frame', ({ t, dynamics }) => addDynamics(periods, t, dynamics === 2));
on('summary', (message) => {
  summary = message.summary;
  periods = (summary.frames || {}).highly_dynamic_periods || [];
  drawMarks();
});
on('finished', () => setTimeline(lastTime()));
on('themed', drawMarks);

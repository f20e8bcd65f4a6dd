// SPDX-License-Identifier: Apache-2.0
// The warnings: bars and sound of the present ones and of what is not known, and the list of those of a finished run.
import { $, element, narrow, on, send, setPill, state } from './page.js';
import { eye } from './camera.js';
import { link } from './connection.js';
import { movers, samplesOf } from './movers.js';
import { indexAt, pointAt } from './path.js';
import { goTo, secondsText, timeNow } from './timeline.js';
import { alarmsOf, barsOf, boxDistance, byMover, isActive, nearestOf, recordedText, unknownOf } from './warnings.js';

let active = [], expanded = false, shown = '';
let known = new Set();  // ids of the warnings shown last
let audio = null, sound = false, soundAsked = false;

function showWarnings(warnings) {
  active = warnings.filter((w) => w.kind !== 'unseen');
  const begins = active.some((w) => !known.has(w.id));
  known = new Set(active.map((w) => w.id));
  state.active = active.length;
  if (begins) beep();
  send('alarmed', alarmsOf(warnings));
  drawBanners();
}
// Returns the present distance of a moving object from the camera [m]; undefined if it is not known.
function distanceNow(id) {
  if (movers.has(id) && eye.visible) return boxDistance(movers.get(id), eye.position.toArray());
}
// Returns a bar for what the page itself does not know; null if there is none.
function unknownNow() {
  if (link.refused) return { text: link.refused, pill: 'no access' };
  return state.live ? unknownOf(link, performance.now()) : null;
}
function drawBanners() {
  const unknown = unknownNow(), old = unknown && state.live, most = expanded ? Infinity : narrow.matches ? 2 : 5;
  const age = Math.floor((performance.now() - (link.connected ? link.heard - link.late : link.closed)) / 1000);
  const all = barsOf(active, state.live, distanceNow), bars = all.slice(0, most).map((bar) => ({
    className: 'warning' + (bar.unknown ? ' unknown' : '') + (old ? ' old' : ''), textContent: bar.text + (old ? ` (${age} s ago)` : '') }));
  if (unknown) bars.unshift({ className: 'warning unknown', textContent: unknown.text });
  const more = all.length - Math.min(all.length, most), buttons = [];
  if (more > 0 || expanded) buttons.push({ className: 'more', textContent: expanded ? 'show fewer' : `+${more} more`, onclick: () => { expanded = !expanded; drawBanners(); } });
  if (state.live && !sound && !soundAsked && (active.length || unknown)) buttons.push({ className: 'more', textContent: '♪ sound is off: turn it on', onclick: toggleSound });
  if (unknown && !state.unknown) beep();
  if (old) setPill(unknown.pill, 'lost');
  state.unknown = unknown ? unknown.text : '';
  state.banners = bars.map((bar) => bar.textContent);
  document.body.classList.toggle('alarm', active.some((w) => w.kind !== 'unknown'));
  document.body.classList.toggle('unknown', Boolean(unknown));
  const key = JSON.stringify([bars, buttons]);
  if (key === shown) return;
  shown = key;
  $('warnings').replaceChildren(...bars.map((bar) => element('div', bar)), ...buttons.map((button) => element('button', button)));
}

function toggleSound() {
  sound = !sound;
  soundAsked = true;
  $('sound').classList.toggle('on', sound);
  drawBanners();
  beep();
}
function beep() {
  if (!sound) return;
  audio = audio || new AudioContext();
  const tone = audio.createOscillator(), level = audio.createGain();
  tone.frequency.value = 880;
  level.gain.setValueAtTime(0.15, audio.currentTime);
  level.gain.exponentialRampToValueAtTime(0.001, audio.currentTime + 0.4);
  tone.connect(level).connect(audio.destination);
  tone.start();
  tone.stop(audio.currentTime + 0.4);
}

$('sound').addEventListener('click', toggleSound);
setInterval(drawBanners, 250);
on('warnings', (message) => {
  state.warnings = message.count;
  showWarnings(message.active);
});

// ---------------------------------------------------------------------------------------------- list
let warnings = [], entries = [], shownAt = '';

// A click on an entry shows when the object was nearest.
function list() {
  entries = byMover(warnings).map((group) => ({ group, ...nearestOf(group, samplesOf(group[0].mover), (t) => pointAt(indexAt(t))) }))
    .sort((a, b) => a.distance - b.distance || a.t - b.t);
  $('events-title').hidden = !warnings.length;
  $('events').replaceChildren(...entries.map(({ group, t, distance }) => {
    const button = element('button', { className: group[0].kind, textContent: recordedText(group, distance), onclick: () => goTo(t) });
    button.dataset.time = secondsText(t);
    return button;
  }));
  state.entries = [...$('events').children].map((button) => button.textContent);
  shownAt = '';
}
function showAt(t) {
  const now = warnings.filter((w) => isActive(w, t)), key = 'active ' + now.map((w) => w.id).join();
  if (!warnings.length || key === shownAt) return;
  shownAt = key;
  [...$('events').children].forEach((button, i) => button.classList.toggle('on', entries[i].group.some((w) => now.includes(w))));
  state.warnings = warnings.length;
  showWarnings(now);
}
// Shows the next warning, or with -1 the one before.
export function stepWarning(direction) {
  const times = warnings.filter((w) => w.kind !== 'unseen').map((w) => w.timestamp), now = timeNow();
  goTo(direction > 0 ? times.find((t) => t > now + 0.01) : times.reverse().find((t) => t < now - 0.01));
}

on('recorded', list);
on('timed', showAt);
on('events', (message) => {
  warnings = message.events;
  state.events = warnings.length;
  list();
  if (!state.live) showAt(timeNow());
});

// SPDX-License-Identifier: Apache-2.0
// Warnings: which are shown as one, in which order, and with which text. They have the keys of events.jsonl (docs/view.md).
import { firstOf, nameOf } from './text.js';

// Whether a warning of a finished run is active at a time.
export const isActive = (w, t) => w.timestamp <= t + 1e-4 && (w.end === null || t < w.end - 1e-4);

// Returns the distance of a place from a box [m].
export const boxDistance = (box, place) => Math.hypot(...box.min.map((low, i) => Math.max(low - place[i], 0, place[i] - box.max[i])));

// Returns what is marked: ids of moving objects, names of zones and of rules of distances, zones out of view.
export function alarmsOf(warnings) {
  const names = (key, ...kinds) => new Set(warnings.filter((w) => kinds.includes(w.kind)).map((w) => w[key]));
  return { movers: names('mover', 'zone', 'near', 'course'), zones: names('rule', 'zone'), rules: names('rule', 'near', 'course'), unseen: names('rule', 'unseen') };
}

// Returns lists of warnings: one per moving object, and one for each warning without one.
export function byMover(warnings) {
  const groups = new Map();
  for (const w of warnings) {
    const key = w.mover || 'warning ' + w.id;
    groups.set(key, (groups.get(key) || []).concat([w]));
  }
  return [...groups.values()];
}

const distanceOf = (w) => (w.distance === undefined ? Infinity : w.distance);

// Returns when a moving object was nearest to the camera while one of its warnings lasted, and how near [m].
// samples: boxes of the object with times; cameraAt: position of the camera at a time
export function nearestOf(warnings, samples, cameraAt) {
  const nearest = { t: warnings[0].timestamp, distance: Math.min(...warnings.map(distanceOf)) };
  for (const sample of samples) {
    if (!warnings.some((w) => isActive(w, sample.t))) continue;
    const distance = boxDistance(sample, cameraAt(sample.t));
    if (distance < nearest.distance) Object.assign(nearest, { t: sample.t, distance });
  }
  return nearest;
}

const rulesOf = (warnings) => [...new Set(warnings.map((w) => w.rule))];

// Returns the text of the first warning, and the other rules that the moving object breaks.
export function liveText([first, ...others]) {
  const more = rulesOf(others).filter((rule) => rule !== first.rule);
  return first.text + (more.length ? '; also: ' + firstOf(more, 2) : '');
}

// Returns the moving object with a distance, and the rules that it breaks: "person 3, 1.2 m away: caution, gate".
export function recordedText(warnings, distance) {
  const [first] = warnings;
  if (!first.mover) return first.text;
  const where = distance === Infinity ? '' : `, ${distance.toFixed(1)} m away`;
  return `${nameOf({ class: first.class, id: first.mover })}${where}: ${firstOf(rulesOf(warnings), 3)}`;
}

// Returns one bar per moving object, the nearest first: {text, unknown}. The texts of a finished run tell distances of other times.
// present: returns the distance of a moving object from the camera [m], undefined if it is not known
export function barsOf(warnings, live, present) {
  return byMover(warnings)
    .map((group) => ({ group, distance: [present(group[0].mover), distanceOf(group[0])].find((x) => x !== undefined) }))
    .sort((a, b) => a.distance - b.distance || a.group[0].id - b.group[0].id)
    .map(({ group, distance }) => ({ text: live ? liveText(group) : recordedText(group, distance), unknown: group[0].kind === 'unknown' }));
}

const SILENCE_MS = 1500;  // time without an image after which the state of a run in progress is not known

// Returns what is not known of a run in progress: {pill, text}; null if nothing.
// link: of connection.js; now: time of the page [ms]
export function unknownOf(link, now) {
  const seconds = (from) => Math.floor((now - from) / 1000) + ' s';
  if (!link.connected) return { pill: 'connection lost', text: `not known: no connection for ${seconds(link.closed)}` };
  if (now - link.heard > SILENCE_MS) return { pill: 'no image', text: `not known: no image for ${seconds(link.heard)}` };
  return link.late > SILENCE_MS ? { pill: 'late', text: `not known: this page is ${(link.late / 1000).toFixed(1)} s late` } : null;
}

// SPDX-License-Identifier: Apache-2.0
// The rows of the time line. A mark is {begin, end, text, shade, faint}: times [s], name of a color of view.css.
import { STATES } from './path.js';
import { findingText, untrusted } from './text.js';

const MAP_EVENTS = { loop: 'loop closed', merge: 'maps joined', dropped: 'map dropped' };
const WARNING_SHADES = { unknown: 'relocalized', unseen: 'dim' };

// Returns the marks of the camera: its states, and the places where the map was corrected.
function cameraMarks(path, mapEvents) {
  const marks = [];
  for (let i = 0; i < path.n; ++i) {
    const last = marks[marks.length - 1], text = STATES[path.s[i]], begin = path.t[i];
    if (last) last.end = begin;
    if (!last || last.text !== text) marks.push({ begin, end: begin, text, shade: text === 'tracked' ? 'accent' : text, faint: text === 'tracked' });
  }
  return marks.concat(mapEvents.map((event) => ({ begin: event.t, end: event.t, text: MAP_EVENTS[event.kind], shade: 'loop' })));
}

function warningMarks(warnings, last) {
  return warnings.map((w) => ({ begin: w.timestamp, end: w.end === null ? last : w.end, text: w.text, shade: WARNING_SHADES[w.kind] || 'lost', faint: true }));
}

// Returns the marks of the findings: those about the whole run, and the frames that they may be due to.
function findingMarks(summary, first, last) {
  const { skipped = [], frames = {} } = summary;
  const at = (t, text) => ({ begin: t, end: t, text, shade: 'relocalized' });
  return untrusted(summary).map((finding) => ({ ...at(first, findingText(finding)), end: last, faint: true }))
    .concat(skipped.map((frame) => at(frame.timestamp, frame.reason)), (frames.uncertain_at || []).map((t) => at(t, 'uncertain pose')));
}

function dynamicsMarks(periods) {
  return periods.map(([begin, end]) => ({ begin, end, text: 'highly dynamic: keypoints on people are removed', shade: 'odometry' }));
}

// Returns the rows that have marks: {name, marks}. Faint marks come first, since other marks lie on them.
// run: {path, mapEvents, warnings, summary, periods}
export function rowsOf({ path, mapEvents, warnings, summary, periods }) {
  const first = path.t[0], last = path.t[path.n - 1];
  return Object.entries({ camera: cameraMarks(path, mapEvents), warnings: warningMarks(warnings, last), findings: findingMarks(summary, first, last), dynamics: dynamicsMarks(periods) })
    .map(([name, marks]) => ({ name, marks: marks.sort((a, b) => Boolean(b.faint) - Boolean(a.faint)) })).filter((row) => row.marks.length);
}

// Returns the texts of the marks between two times, at most four; marks on top first.
export function textsBetween(row, begin, end) {
  const marks = row ? row.marks.filter((mark) => mark.begin <= end && mark.end >= begin).reverse() : [];
  const texts = [...new Set(marks.map((mark) => mark.text))];
  return texts.length > 4 ? [...texts.slice(0, 4), `and ${texts.length - 4} more`] : texts;
}

// Adds the verdict of the preset gated-seg on a frame to the highly dynamic periods [begin, end].
export function addDynamics(periods, t, high) {
  const last = periods[periods.length - 1], open = last && last.open;
  if (open) { last[1] = t; last.open = high; } else if (high) periods.push(Object.assign([t, t], { open: true }));
}

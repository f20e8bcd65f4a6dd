// SPDX-License-Identifier: Apache-2.0
// Texts of numbers and names.

export const countText = (n) => (n >= 1e6 ? (n / 1e6).toFixed(2) + ' M' : n >= 1e4 ? Math.round(n / 1e3) + ' k' : String(n));
export const msText = (x) => (x >= 1000 ? (x / 1000).toFixed(1) + ' s' : (x < 10 ? x.toFixed(1) : Math.round(x)) + ' ms');
export const percentText = (share) => (100 * share).toFixed(1) + ' %';
export const vectorText = (v, digits) => '[' + v.map((x) => x.toFixed(digits)).join(', ') + ']';

// Returns the name of a moving object; those without a number have an id that is not positive.
export function nameOf(object) {
  const name = !object.class || object.class === 'unknown' ? 'object' : object.class;
  return object.id > 0 ? `${name} ${object.id}` : name;
}

// Returns the middle of a box along the axes of the world.
export const middleOf = ({ min, max }) => min.map((low, k) => (low + max[k]) / 2);

// Returns what happened to an object between two visits: "went", "moved 1.24 m".
export function changeText({ kind, before, after }) {
  if (!before || !after) return kind;
  const [from, to] = [before, after].map(middleOf);
  return `${kind} ${Math.hypot(...to.map((x, k) => x - from[k])).toFixed(2)} m`;
}

// Returns the first names and the number of the others; a single other one is named.
export const firstOf = (names, most) => (names.length > most + 1 ? `${names.slice(0, most).join(', ')} and ${names.length - most} more` : names.join(', '));

// Returns the file of --zones for some zones.
// guessed: whether `up` is a guess
export function zonesYaml(zones, up, guessed) {
  const text = (zone) => `  - name: ${zone.name}\n    polygon: [${zone.polygon.map((corner) => vectorText(corner, 3)).join(', ')}]\n    height: [${zone.height.join(', ')}]\n`;
  return '# Zones of Stillmap, in the world frame of the trajectory [m]; docs/view.md explains them.\n'
    + (guessed ? '# up is a guess: the mean upward direction of the images. Check it.\n' : '')
    + `up: [${up.join(', ')}]\nzones:\n${zones.map(text).join('')}`;
}

// Returns the findings of a summary by which its result should not be trusted.
export const untrusted = ({ findings = [] }) => findings.filter((finding) => finding.severity === 'untrusted');
export const findingText = ({ message, fix }) => (fix ? `${message}; ${fix}` : message);

// SPDX-License-Identifier: Apache-2.0
// The camera's path: time [s], position and rotation, and state of each frame.

export const STATES = ['tracked', 'lost', 'relocalized', 'odometry'];
export const LOST = 1, RELOCALIZED = 2;
export const path = { n: 0, t: new Float64Array(0), p: new Float32Array(0), s: new Uint8Array(0) };

export function pushFrame(t, pose, s) {
  if (path.n === path.t.length) {
    for (const [key, size] of [['t', 1], ['p', 7], ['s', 1]]) {
      const larger = new path[key].constructor(size * Math.max(1024, 2 * path.n));
      larger.set(path[key]);
      path[key] = larger;
    }
  }
  path.t[path.n] = t;
  path.p.set(pose, 7 * path.n);
  path.s[path.n++] = s;
}

// Takes the path of a message.
// keepNewest: whether the newest frame stays if the path ends before it
export function setPath({ n, t, p, s }, keepNewest) {
  const newest = path.n ? [path.t[path.n - 1], poseAt(path.n - 1).slice(), path.s[path.n - 1]] : null;
  Object.assign(path, { n, t, p, s });
  if (keepNewest && newest && (!n || newest[0] > t[n - 1] + 1e-4)) pushFrame(...newest);
}

// Returns the first index of a sorted array whose value is not less than `value`; n without one.
export function lower(array, n, value) {
  let low = 0, high = n;
  while (low < high) { const middle = (low + high) >> 1; if (array[middle] < value) low = middle + 1; else high = middle; }
  return low;
}

export const firstTime = () => (path.n ? path.t[0] : 0);
export const lastTime = () => (path.n ? path.t[path.n - 1] : 0);
// Returns the frame at a time, or the last one.
export const indexAt = (t) => Math.min(path.n - 1, lower(path.t, path.n, t - 1e-4));
export const poseAt = (i) => path.p.subarray(7 * i, 7 * i + 7);
export const pointAt = (i) => [...path.p.subarray(7 * i, 7 * i + 3)];

export function pathLength() {
  const p = path.p;
  let length = 0;
  for (let i = 7; i < 7 * path.n; i += 7) length += Math.hypot(p[i] - p[i - 7], p[i + 1] - p[i - 6], p[i + 2] - p[i - 5]);
  return length;
}

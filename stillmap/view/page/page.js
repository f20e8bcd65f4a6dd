// SPDX-License-Identifier: Apache-2.0
// What all parts of the page share: its elements, what happens, and the state that tests read.

export const $ = (id) => document.getElementById(id);
export const element = (tag, properties = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
};
export const css = (name) => getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim();
export const isLight = () => document.documentElement.dataset.theme === 'light';
export const narrow = matchMedia('(max-width: 760px), (max-height: 500px)'), phone = narrow.matches;
// Whether WebGL runs in software, as on computers without a graphics processor.
export const software = (() => {
  const gl = document.createElement('canvas').getContext('webgl'), info = gl && gl.getExtension('WEBGL_debug_renderer_info');
  return Boolean(info) && /swiftshader|llvmpipe|software|basic render/i.test(gl.getParameter(info.UNMASKED_RENDERER_WEBGL));
})();

export const state = window.stillmap = {
  connected: false, connections: 0, bytes: 0, live: false, finished: false, frames: 0, frame: -1, images: 0, noImage: '', boxes: [],
  points: 0, drawn: 0, triangles: 0, texture: 0, movers: 0, red: 0, changes: 0, path: 0, keyframes: 0, zones: 0, planner: false, warnings: 0, active: 0, events: 0,
  entries: [], banners: [], unknown: '', rows: {}, hint: '', up: null, upFrom: '', view: 'orbit', fps: 0, renders: 0,
  budget: software ? 3e4 : phone ? 2e5 : 5e5, sharpness: 1, errors: 0,
};
addEventListener('error', () => { state.errors += 1; });
addEventListener('unhandledrejection', () => { state.errors += 1; });

// Parts of the page learn from each other by events: the type of a message, or one of
//   themed       light or dark
//   grounded     the floor or the upward direction has changed
//   eye-moved    the pose of the camera
//   movers-drawn the moving objects
//   alarmed      what has warnings, as alarmsOf() returns it
//   map-changed  the points of the map
//   recorded     the data of a finished run
//   timed        the time of the slider [s]
// Functions are called in the order of the imports in main.js.
const listeners = new Map();
export const on = (event, call) => { listeners.set(event, (listeners.get(event) || []).concat([call])); };
export const send = (event, value) => { for (const call of listeners.get(event) || []) call(value); };

export function setPill(text, kind = '') {
  $('state').textContent = text;
  $('state').className = 'pill ' + kind;
}
export const setCount = (layer, text) => { $('n-' + layer).textContent = text; };

// SPDX-License-Identifier: Apache-2.0
// The scene: renderer, layers and cameras of the view; lines and labels in it.
import { $, css, element, isLight, narrow, phone, setPill, software, state } from './page.js';

export const renderer = (() => {
  try {
    return new THREE.WebGLRenderer({ canvas: $('canvas'), antialias: !phone && !software, powerPreference: 'high-performance' });
  } catch (e) {
    setPill('this browser has no WebGL');
    throw e;
  }
})();
renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
export const scene = new THREE.Scene();
export const world = new THREE.Group();  // the world of the trajectory, turned so that its floor is y = 0
scene.add(world);
export const layers = {};
for (const name of ['cloud', 'mesh', 'path', 'keyframes', 'loops', 'movers', 'objects', 'changes', 'zones', 'points', 'floor', 'obstacles', 'free']) {
  layers[name] = new THREE.Group();
  world.add(layers[name]);
}
layers.grid = new THREE.Group();
layers.measure = new THREE.Group();
scene.add(layers.grid, layers.measure);
layers.zones.renderOrder = layers.measure.renderOrder = 1;  // drawn last, so that the map does not hide them

// Removes all objects of a layer.
export function empty(layer) {
  layer.traverse((part) => { if (part.geometry) { part.geometry.dispose(); part.material.dispose(); } });
  layer.remove(...layer.children);
}

export const orbitCamera = new THREE.PerspectiveCamera(55, 1, 0.05, 2000);
orbitCamera.position.set(-4, 5, 6);
export const topCamera = new THREE.OrthographicCamera(-5, 5, 5, -5, -500, 1000);
topCamera.position.set(0, 100, 0);
topCamera.up.set(0, 0, -1);
topCamera.lookAt(0, 0, 0);
export const orbit = new THREE.OrbitControls(orbitCamera, renderer.domElement);
export const above = new THREE.OrbitControls(topCamera, renderer.domElement);
orbit.enableKeys = above.enableKeys = false;
orbit.screenSpacePanning = above.screenSpacePanning = true;
orbit.maxDistance = 900;
above.enableRotate = false;
above.mouseButtons.LEFT = THREE.MOUSE.PAN;
above.touches.ONE = THREE.TOUCH.PAN;
above.enabled = false;

// name: orbit, top or follow; touched: the user has moved the camera; dirty: the picture has to be drawn again
export const view = { name: 'orbit', touched: false, dirty: true };
export const redraw = () => { view.dirty = true; };
for (const controls of [orbit, above]) {
  controls.addEventListener('change', redraw);
  controls.addEventListener('start', () => { view.touched = true; });
}
export const camera = () => (view.name === 'top' ? topCamera : orbitCamera);
export const topHeight = () => (topCamera.top - topCamera.bottom) / topCamera.zoom;  // height that the top view shows [m]
export const tangent = () => Math.tan(orbitCamera.fov * Math.PI / 360);  // of half the vertical field of view

export const color = (name) => new THREE.Color(css(name));
export const colorOfId = (id) => new THREE.Color().setHSL((0.93 + id * 0.381966) % 1, 0.85, isLight() ? 0.42 : 0.66);

// Size of the canvas, and side of a drawn pixel [CSS pixels].
export const picture = { value: new THREE.Vector3(1, 1, 1) };
export function resizeScene() {
  renderer.setSize(innerWidth, innerHeight, false);
  orbitCamera.aspect = innerWidth / innerHeight;
  topCamera.right = (topCamera.top - topCamera.bottom) / 2 * orbitCamera.aspect;
  topCamera.left = -topCamera.right;
  picture.value.set(innerWidth, innerHeight, picture.value.z);
}
// Centers the view in the area without panels. Returns the free share of the canvas in width and height.
export function arrange() {
  const box = (id) => $(id).getBoundingClientRect(), beside = !narrow.matches, right = box('frame'), below = box('timeline');
  const x = [beside ? box('layers').right : 0, beside && right.width ? right.left : innerWidth];
  const y = [box('top').bottom, below.height ? below.top : innerHeight];
  for (const e of [orbitCamera, topCamera]) e.setViewOffset(innerWidth, innerHeight, (innerWidth - x[0] - x[1]) / 2, (innerHeight - y[0] - y[1]) / 2, innerWidth, innerHeight);
  state.free = [x[0], y[0], x[1], y[1]];
  redraw();
  return [(x[1] - x[0]) / innerWidth, (y[1] - y[0]) / innerHeight].map((share) => Math.max(0.2, 0.92 * share));
}

// ---------------------------------------------------------------------------------------------- lines
// Lines have a width in CSS pixels, two triangles per segment: WebGL's own lines are too thin on high-resolution screens.
const VERTEX_SHADER = `
  precision highp float;
  attribute vec3 position, begin, end, beginColor, endColor;
  uniform mat4 modelViewMatrix, projectionMatrix;
  uniform vec3 picture;
  uniform float width;
  uniform vec3 shade;
  varying vec3 ink;
  void main() {
    vec4 a = modelViewMatrix * vec4(begin, 1.0), b = modelViewMatrix * vec4(end, 1.0);
    if (projectionMatrix[3][3] < 0.5) {  // perspective: the part behind the viewer is cut off
      const float near = -0.02;
      if (a.z > near && b.z > near) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
      if (a.z > near) a = mix(a, b, (near - a.z) / (b.z - a.z));
      if (b.z > near) b = mix(b, a, (near - b.z) / (a.z - b.z));
    }
    a = projectionMatrix * a;
    b = projectionMatrix * b;
    vec2 along = (b.xy / b.w - a.xy / a.w) * picture.xy;
    along /= max(length(along), 1e-6);
    gl_Position = position.x < 0.5 ? a : b;
    gl_Position.xy += position.y * max(width, 1.2 * picture.z) * vec2(-along.y, along.x) / picture.xy * gl_Position.w;
    ink = shade;
    #ifdef COLORED
      ink = position.x < 0.5 ? beginColor : endColor;
    #endif
  }`;
const FRAGMENT_SHADER = 'precision mediump float; uniform float opacity; varying vec3 ink; void main() { gl_FragColor = vec4(ink, opacity); }';

// Returns lines between pairs of points, or with `strip` one line through all points.
export function linesOf(points, { shade = color('text'), opacity = 1, width = 1.5, strip = false, colors = null, onTop = false } = {}) {
  const geometry = new THREE.InstancedBufferGeometry();
  const ends = (values, a, b) => {
    const buffer = new THREE.InstancedInterleavedBuffer(new Float32Array(values), strip ? 3 : 6, 1);
    geometry.setAttribute(a, new THREE.InterleavedBufferAttribute(buffer, 3, 0));
    geometry.setAttribute(b, new THREE.InterleavedBufferAttribute(buffer, 3, 3));
  };
  ends(points, 'begin', 'end');
  if (colors) ends(colors, 'beginColor', 'endColor');
  geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array([0, -1, 0, 0, 1, 0, 1, -1, 0, 1, 1, 0]), 3));  // end, side
  geometry.setIndex([0, 1, 2, 2, 1, 3]);
  geometry.maxInstancedCount = Math.max(0, strip ? points.length / 3 - 1 : points.length / 6);
  const material = new THREE.RawShaderMaterial({
    uniforms: { picture, width: { value: width }, shade: { value: new THREE.Color(shade) }, opacity: { value: opacity } },
    defines: colors ? { COLORED: 1 } : {}, transparent: opacity < 1, depthTest: !onTop, side: THREE.DoubleSide,
    vertexShader: VERTEX_SHADER, fragmentShader: FRAGMENT_SHADER,
  });
  material.color = material.uniforms.shade.value;
  const lines = new THREE.Mesh(geometry, material);
  lines.frustumCulled = false;
  return lines;
}
export function addLines(layer, points, style) { if (points.length) layer.add(linesOf(points, style)); }
export function setLines(layer, points, style) {
  empty(layer);
  addLines(layer, points, style);
}

const EDGES = [0, 1, 1, 3, 3, 2, 2, 0, 4, 5, 5, 7, 7, 6, 6, 4, 0, 4, 1, 5, 2, 6, 3, 7];
export const cornerOf = (min, max, i) => [i & 1 ? max[0] : min[0], i & 2 ? max[1] : min[1], i & 4 ? max[2] : min[2]];
// Returns the edges of a box by its center, its sizes, and its axes.
export const boxEdges = ({ center, size, axes }) => EDGES.flatMap((i) => center.map((c, k) => c + axes.reduce((sum, axis, j) => sum + (i >> j & 1 ? 0.5 : -0.5) * size[j] * axis[k], 0)));

// ---------------------------------------------------------------------------------------------- labels
// Names at places of the map. The key of a label begins with its layer: "movers:3".
const labels = new Map(), projected = new THREE.Vector3();

// Places a name and a smaller text behind it.
export function setLabel(key, position, [name, detail], shade, kind) {
  if (!labels.has(key)) {
    labels.set(key, { element: element('div'), position: new THREE.Vector3() });
    $('labels').append(labels.get(key).element);
  }
  const label = labels.get(key);
  label.position.set(...position);
  label.element.className = 'label ' + kind;
  label.element.style.setProperty('--color', shade);
  label.element.replaceChildren(element('span', { textContent: detail ? name + ' ' : name }), ...(detail ? [element('small', { textContent: detail })] : []));
}
export function dropLabels(layer, kept = new Set()) {
  for (const [key, label] of labels) if (key.startsWith(layer + ':') && !kept.has(key)) { label.element.remove(); labels.delete(key); }
}
// Returns the place of a point of the world in the picture: x and y are -1 to 1, z is below 1 before the camera.
export const project = (point) => projected.copy(point).applyMatrix4(world.matrixWorld).project(camera());
export function placeLabels() {
  for (const [key, label] of labels) {
    const { x, y, z } = project(label.position), shown = layers[key.split(':')[0]].visible && z < 1 && Math.max(Math.abs(x), Math.abs(y)) < 1.1;
    label.element.style.display = shown ? '' : 'none';
    if (shown) label.element.style.transform = `translate(${((x + 1) / 2 * innerWidth).toFixed(1)}px, ${((1 - y) / 2 * innerHeight).toFixed(1)}px) translate(-50%, -120%)`;
  }
}

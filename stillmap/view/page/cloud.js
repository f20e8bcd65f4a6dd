// SPDX-License-Identifier: Apache-2.0
// The points of the map. They come in cubes; the points of each are in random order, so that the first ones are a sample.
import { $, element, on, send, setCount, software, state } from './page.js';
import { camera, layers, redraw, renderer, tangent, topHeight, view } from './scene.js';
import { countText } from './text.js';

const OVERVIEW = 2e5;  // points of the sample of the whole map
const STAGED_MS = 500;  // cubes are shown after this time if the message "cloud" does not come

const material = new THREE.RawShaderMaterial({
  uniforms: {
    size: { value: 1 }, ortho: { value: 0 }, mode: { value: 0 }, cut: { value: 1e9 }, heights: { value: new THREE.Vector2(0, 2.5) },
    palette: { value: null }, colors: { value: 1 },
  },
  vertexShader: `
    precision highp float;
    attribute vec4 position;
    attribute vec4 color;
    uniform mat4 modelMatrix, viewMatrix, projectionMatrix;
    uniform float size, ortho, mode, cut, colors;
    uniform vec2 heights;
    uniform sampler2D palette;
    varying vec3 shade;
    vec3 ramp(float x) {
      x = clamp(x, 0.0, 1.0);
      return clamp(vec3(1.5 - abs(4.0 * x - 3.2), 1.5 - abs(4.0 * x - 2.0), 1.5 - abs(4.0 * x - 0.8)), 0.12, 0.95);
    }
    void main() {
      vec4 p = modelMatrix * vec4(position.xyz, 1.0);
      vec4 seen = viewMatrix * p;
      gl_Position = p.y > cut ? vec4(2.0, 2.0, 2.0, 1.0) : projectionMatrix * seen;
      gl_PointSize = clamp(ortho > 0.5 ? size : size / max(0.05, -seen.z), 1.0, 24.0);
      shade = color.rgb;
      if (mode > 1.5) shade = ramp((p.y - heights.x) / (heights.y - heights.x)) * (0.55 + 0.45 * dot(color.rgb, vec3(0.3, 0.6, 0.1)));
      else if (mode > 0.5) {
        float label = position.w * 65535.0;
        shade = label > 0.5 ? mix(texture2D(palette, vec2((label - 0.5) / colors, 0.5)).rgb, color.rgb, 0.25)
                            : vec3(dot(color.rgb, vec3(0.3, 0.6, 0.1))) * 0.55 + 0.1;
      }
    }`,
  fragmentShader: 'precision mediump float; varying vec3 shade; void main() { gl_FragColor = vec4(shade, 1.0); }',
});
const uniforms = material.uniforms;
export const shownBelow = uniforms.cut;
// The heights at which the colors end, and above which points are hidden [m above the floor].
export function setColorHeight(height) { uniforms.heights.value.set(0, height); }
export function setCutHeight(height) { uniforms.cut.value = height; }

// ---------------------------------------------------------------------------------------------- colors
let classes = 0;
function setPalette({ colors, names }) {
  classes = names.length;
  $('classes').replaceChildren(...names.map((name, i) => {
    const patch = element('i', { className: 'patch' });
    patch.style.background = `rgb(${colors[i].join()})`;
    return element('span', {}, patch, name);
  }));
  const data = Uint8Array.from(colors.length ? colors.flat() : [0, 0, 0]);
  uniforms.palette.value = new THREE.DataTexture(data, data.length / 3, 1, THREE.RGBFormat);
  uniforms.palette.value.needsUpdate = true;
  uniforms.colors.value = data.length / 3;
  showColors();
}
function showColors() {
  uniforms.mode.value = Number($('colors').value);
  $('colors').options[2].hidden = $('colors').options[2].disabled = !classes;
  $('classes').hidden = $('colors').value !== '1' || !classes;
  $('heights').hidden = $('colors').value !== '2';
  redraw();
}
export function nextColors() {
  $('colors').selectedIndex = ($('colors').selectedIndex + 1) % (classes ? 3 : 2);
  showColors();
}
// The colors of heights, as the shader has them.
$('heights-bar').style.background = `linear-gradient(90deg, ${[...Array(13).keys()].map((i) => {
  const part = (k) => Math.round(255 * Math.min(0.95, Math.max(0.12, 1.5 - Math.abs(i / 3 - k))));
  return `rgb(${part(3.2)}, ${part(2)}, ${part(0.8)})`;
}).join()})`;
$('colors').addEventListener('change', showColors);
$('size').addEventListener('input', redraw);

// ---------------------------------------------------------------------------------------------- cubes
const chunks = new Map();  // "x/y/z" -> {mesh, count, edge, shown: number of points drawn}
const overview = new THREE.Points(new THREE.BufferGeometry(), material);  // a sample of all chunks in random order
overview.frustumCulled = false;
overview.count = 0;
layers.cloud.add(overview);
const staged = new Map();  // chunks that are not shown yet
let stagedSince = 0, share = 1;

function removeChunk(key) {
  const chunk = chunks.get(key);
  if (!chunk) return;
  layers.cloud.remove(chunk.mesh);
  chunk.mesh.geometry.dispose();
  chunks.delete(key);
}
function addChunk(key, { cell, edge, count, positions, colors }) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(positions, 4, true));
  geometry.setAttribute('color', new THREE.BufferAttribute(colors, 4, true));
  geometry.boundingSphere = new THREE.Sphere(new THREE.Vector3(32768, 32768, 32768).divideScalar(65535), 0.87);
  const mesh = new THREE.Points(geometry, material);
  mesh.scale.setScalar(edge);
  mesh.position.set(...cell).multiplyScalar(edge);
  layers.cloud.add(mesh);
  chunks.set(key, { mesh, count, edge, shown: 0 });
}
// A state of the map appears in one piece, so that a corrected map never overlaps with the old one for long.
function showStaged() {
  for (const [key, chunk] of staged) {
    removeChunk(key);
    if (chunk.count) addChunk(key, chunk);
  }
  staged.clear();
  countPoints();
  send('map-changed');
}
export function showLateChunks(time) { if (staged.size && time - stagedSince > STAGED_MS) showStaged(); }
function countPoints() {
  state.points = [...chunks.values()].reduce((sum, chunk) => sum + chunk.count, 0);
  setCount('points', countText(state.points));
  sampleChunks();
  redraw();
}
function sampleChunks() {
  const part = Math.min(1, OVERVIEW / Math.max(1, state.points)), list = [...chunks.values()].map((chunk) => [chunk, Math.ceil(part * chunk.count)]);
  const n = list.reduce((sum, [, k]) => sum + k, 0);
  overview.geometry.dispose();
  overview.geometry = new THREE.BufferGeometry();
  overview.count = n;
  if (!n) return;
  const positions = new Float32Array(4 * n), colors = new Uint8Array(4 * n);
  let step = Math.floor(0.618 * n) | 1, at = 0;
  const common = (a, b) => (b ? common(b, a % b) : a);
  while (common(step, n) > 1) step += 2;  // so that all places are met
  for (const [{ mesh, edge }, k] of list) {
    const p = mesh.geometry.attributes.position.array, c = mesh.geometry.attributes.color.array, o = mesh.position;
    for (let i = 0; i < 4 * k; i += 4, at = (at + step) % n) {
      positions.set([o.x + edge * p[i] / 65535, o.y + edge * p[i + 1] / 65535, o.z + edge * p[i + 2] / 65535, p[i + 3] / 65535], 4 * at);
      colors.set([c[i], c[i + 1], c[i + 2], 255], 4 * at);
    }
  }
  overview.geometry.setAttribute('position', new THREE.BufferAttribute(positions, 4));
  overview.geometry.setAttribute('color', new THREE.BufferAttribute(colors, 4, true));
}

// ---------------------------------------------------------------------------------------------- drawing
// Draws the first points of each chunk, more of near ones, as many as the budget allows. Returns the share of the wanted ones.
const sphere = new THREE.Sphere(), frustum = new THREE.Frustum(), matrix = new THREE.Matrix4();
export function distribute(budget) {
  const eye = camera();
  matrix.multiplyMatrices(eye.projectionMatrix, eye.matrixWorldInverse);
  frustum.setFromMatrix(matrix);
  const wanted = [];
  let sum = 0;
  for (const chunk of chunks.values()) {
    const { mesh, count, edge } = chunk;
    sphere.copy(mesh.geometry.boundingSphere).applyMatrix4(mesh.matrixWorld);
    mesh.visible = false;
    chunk.shown = 0;
    if (!frustum.intersectsSphere(sphere)) continue;
    const distance = Math.max(edge, sphere.center.distanceTo(eye.position) - sphere.radius);
    const want = view.name === 'top' ? count : count * Math.min(1, (6 * edge / distance) ** 2 + 0.05);
    wanted.push([chunk, want]);
    sum += want;
  }
  share = Math.min(1, budget / Math.max(1, sum));
  // Few points of many chunks are drawn at once, as each chunk that is drawn takes time, too.
  overview.visible = share < 1 && budget < 1000 * wanted.length;
  overview.geometry.setDrawRange(0, Math.min(overview.count, budget));
  state.drawn = overview.visible ? overview.geometry.drawRange.count : 0;
  for (const [chunk, want] of wanted) {
    chunk.shown = Math.ceil(want * share);
    chunk.mesh.visible = !overview.visible;
    chunk.mesh.geometry.setDrawRange(0, chunk.shown);
    if (!overview.visible) state.drawn += chunk.shown;
  }
  setPointSize();
  return share;
}
// Fewer points are drawn larger, so that surfaces stay closed.
function setPointSize() {
  const height = renderer.domElement.height, gap = 0.022 * Number($('size').value) * Math.min(software ? 1.7 : 3, Math.sqrt(1 / share));
  uniforms.ortho.value = view.name === 'top' ? 1 : 0;
  uniforms.size.value = gap * height / (view.name === 'top' ? topHeight() : 2 * tangent());
}

// ---------------------------------------------------------------------------------------------- places
const placeOf = (mesh, i, out) => out.fromBufferAttribute(mesh.geometry.attributes.position, i).divideScalar(65535).applyMatrix4(mesh.matrixWorld);
// Returns some points of the map, with the floor at y = 0.
export function someMapPoints() {
  const list = [];
  layers.cloud.updateMatrixWorld(true);
  for (const { mesh, count } of chunks.values()) {
    for (let i = 0; i < count; i += Math.max(1, Math.floor(count / 40))) list.push(placeOf(mesh, i, new THREE.Vector3()));
  }
  return list;
}
// Returns the drawn point nearest to the viewer within a few pixels of a ray; null without one.
export function pointNear(ray) {
  const best = { distance: Infinity, point: null }, p = new THREE.Vector3();
  for (const { mesh, shown } of chunks.values()) {
    if (!shown) continue;
    sphere.copy(mesh.geometry.boundingSphere).applyMatrix4(mesh.matrixWorld);
    if (ray.distanceToPoint(sphere.center) > sphere.radius + 0.1) continue;
    for (let i = 0; i < shown; ++i) {
      placeOf(mesh, i, p);
      if (p.y > uniforms.cut.value) continue;
      const distance = p.clone().sub(ray.origin).dot(ray.direction), limit = 5 / innerHeight * (view.name === 'top' ? topHeight() : 2 * tangent() * distance);
      if (distance > 0 && distance < best.distance && ray.distanceToPoint(p) < limit) { best.distance = distance; best.point = p.clone(); }
    }
  }
  return best.point;
}

on('chunk', (chunk) => {
  if (!staged.size) stagedSince = performance.now();
  staged.set(chunk.cell.join('/'), chunk);
});
on('cloud', showStaged);
on('palette', setPalette);
on('run', () => {
  for (const key of [...chunks.keys()]) removeChunk(key);
  staged.clear();
  countPoints();
});

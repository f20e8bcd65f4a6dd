// SPDX-License-Identifier: Apache-2.0
// The textured mesh of a finished run, shown in place of the points and of the planner's cells.
import { $, on, setCount, state } from './page.js';
import { shownBelow } from './cloud.js';
import { empty, layers, redraw } from './scene.js';
import { countText } from './text.js';

const VERTEX_SHADER = `
  precision highp float;
  attribute vec3 position;
  attribute vec2 uv;
  uniform mat4 modelMatrix, viewMatrix, projectionMatrix;
  varying vec2 place;
  varying float height;
  void main() {
    vec4 p = modelMatrix * vec4(position, 1.0);
    height = p.y;
    place = uv;
    gl_Position = projectionMatrix * viewMatrix * p;
  }`;
const FRAGMENT_SHADER = `
  precision highp float;
  uniform sampler2D image;
  uniform float cut;
  varying vec2 place;
  varying float height;
  void main() {
    if (height > cut) discard;
    gl_FragColor = vec4(texture2D(image, place).rgb, 1.0);
  }`;

// Sides of any number of texels, and the first row on top as in the file.
function textureOf(jpeg) {
  const texture = new THREE.Texture(new Image());
  Object.assign(texture, { flipY: false, generateMipmaps: false, minFilter: THREE.LinearFilter });
  texture.image.onload = () => {
    URL.revokeObjectURL(texture.image.src);
    texture.needsUpdate = true;
    state.texture = texture.image.width * texture.image.height;
    redraw();
  };
  texture.image.src = URL.createObjectURL(new Blob([jpeg], { type: 'image/jpeg' }));
  return texture;
}

on('mesh', ({ positions, places, triangles, jpeg }) => {
  empty(layers.mesh);
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
  geometry.setAttribute('uv', new THREE.BufferAttribute(places, 2));
  geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
  const uniforms = { image: { value: textureOf(jpeg) }, cut: shownBelow };
  layers.mesh.add(new THREE.Mesh(geometry, new THREE.RawShaderMaterial({ uniforms, vertexShader: VERTEX_SHADER, fragmentShader: FRAGMENT_SHADER, side: THREE.DoubleSide })));
  state.triangles = triangles.length / 3;
  setCount('mesh', countText(state.triangles));
  for (const covering of ['cloud', 'obstacles', 'free']) document.querySelector(`[data-layer=${covering}]`).checked = false;
  $('colors').title = 'Of the points; the mesh has those of the images';
  redraw();
});

// SPDX-License-Identifier: Apache-2.0
// The changes between two visits: boxes, arrows and names in the later map, and the list of them.
import { $, css, element, on, setCount, state } from './page.js';
import { flyTo } from './ground.js';
import { standing, topOf } from './movers.js';
import { addLines, boxEdges, color, dropLabels, empty, layers, redraw, setLabel } from './scene.js';
import { changeText, middleOf, nameOf } from './text.js';

let message = { changes: [] };

// Returns the boxes of a change with the names of their colors, the present place last.
const placesOf = ({ before, after }) => [[before, after ? 'from' : 'went'], [after, before ? 'to' : 'appeared']].filter(([box]) => box);
function drawArrow(from, to) {
  const tip = new THREE.Vector3(...to), along = tip.clone().sub(new THREE.Vector3(...from)).normalize();
  const head = new THREE.Mesh(new THREE.ConeBufferGeometry(0.06, 0.2, 12), new THREE.MeshBasicMaterial({ color: color('to'), depthTest: false }));
  head.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along);
  head.position.copy(tip).addScaledVector(along, -0.1);
  layers.changes.add(head);
  addLines(layers.changes, [...from, ...to], { shade: color('to'), width: 2.5, onTop: true });
}
function drawChange(change, k) {
  const places = placesOf(change), [box, name] = places[places.length - 1];
  for (const [place, shade] of places) addLines(layers.changes, boxEdges(standing(place)), { shade: color(shade), width: 2 });
  if (places.length > 1) drawArrow(...places.map(([place]) => middleOf(place)));
  setLabel('changes:' + k, topOf(standing(box)), [nameOf(change), changeText(change)], css(name), 'object');
}
// What is not there any more is drawn as points.
function drawPoints(positions, shade) {
  const geometry = new THREE.BufferGeometry(), material = new THREE.PointsMaterial({ size: 2, sizeAttenuation: false, color: color(shade) });
  geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(positions), 3));
  layers.changes.add(new THREE.Points(geometry, material));
}
function draw() {
  empty(layers.changes);
  dropLabels('changes');
  message.changes.forEach(drawChange);
  if (message.changes.length) for (const shade of ['went', 'from']) drawPoints(message[shade], shade);
  redraw();
}
// A click on an entry shows both places of the object.
function list() {
  $('changes').replaceChildren(...message.changes.map((change) => {
    const places = placesOf(change), [, name] = places[places.length - 1], all = new THREE.Box3();
    for (const [{ min, max }] of places) all.union(new THREE.Box3(new THREE.Vector3(...min), new THREE.Vector3(...max)));
    const { center, radius } = all.getBoundingSphere(new THREE.Sphere());
    return element('button', { onclick: () => flyTo(center.toArray(), radius) }, element('i', { className: 'box ' + name }), ` ${nameOf(change)} `, element('small', { textContent: changeText(change) }));
  }));
  state.changes = message.changes.length;
  setCount('changes', state.changes);
}

on('changes', (received) => {
  message = received;
  list();
  draw();
});
on('grounded', draw);
on('themed', draw);

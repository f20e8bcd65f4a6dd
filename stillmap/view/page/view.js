// SPDX-License-Identifier: Apache-2.0
// The page of the view: reads the messages that docs/view.md describes and draws them with three.js.
'use strict';
(() => {
  const $ = (id) => document.getElementById(id);
  const TRAIL_SECONDS = 4, PREDICTED_SECONDS = 1.5;
  const STATES = ['tracked', 'lost', 'relocalized', 'odometry'];
  const STAGES = { features: '#4fa3ff', masks: '#b78cff', motion: '#ffb454', pose: '#43d17a' };
  const narrow = matchMedia('(max-width: 760px), (max-height: 500px)'), phone = narrow.matches;
  // Whether WebGL runs in software, as on computers without a graphics processor.
  const software = (() => {
    const gl = document.createElement('canvas').getContext('webgl'), info = gl && gl.getExtension('WEBGL_debug_renderer_info');
    return Boolean(info) && /swiftshader|llvmpipe|software|basic render/i.test(gl.getParameter(info.UNMASKED_RENDERER_WEBGL));
  })();
  // Points drawn while the picture changes: as many as take FRAME_MS, at least MIN_BUDGET. At rest more are added.
  const MIN_BUDGET = 1e4, OVERVIEW = 2e5, ENOUGH = 3e5, MAX_BUDGET = phone ? 3e6 : 2e7, FRAME_MS = 33, REST_MS = 300, SLOWEST_MS = 700;
  const UNSURE = 0.3;  // confidence below which the class of a static object is shown with a question mark
  const SILENCE_MS = 1500;  // time without an image after which the state of a run in progress is not known
  const COARSEST = 0.5;  // least sharpness: share of the screen's pixels along each side

  // State of the page, which tests read.
  const state = window.stillmap = {
    connected: false, connections: 0, bytes: 0, messages: 0, frames: 0, frame: -1, latency: null, live: false,
    finished: false, points: 0, drawn: 0, chunks: 0, movers: 0, path: 0, keyframes: 0, loops: 0, images: 0, objects: 0,
    zones: 0, warnings: 0, events: 0, entries: [], findings: 0, rows: {}, hint: '', noImage: '', boxes: [], planner: null, classes: 0, rings: 0, up: null, upFrom: '', unknown: '', red: 0, banners: [], more: 0, refused: '', view: 'orbit', fps: 0, renders: 0, budget: software ? 3e4 : phone ? 2e5 : 5e5, sharpness: 1, errors: 0,
  };
  window.addEventListener('error', () => { state.errors += 1; });

  // ---------------------------------------------------------------------------------------------- scene
  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ canvas: $('canvas'), antialias: !phone && !software, powerPreference: 'high-performance' });
  } catch (e) {
    $('state').textContent = 'this browser has no WebGL';
    throw e;
  }
  renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  const scene = new THREE.Scene();
  const world = new THREE.Group();  // the world of the trajectory, turned so that its floor is y = 0
  scene.add(world);
  const layers = {};
  for (const name of ['cloud', 'path', 'keyframes', 'loops', 'movers', 'objects', 'zones', 'points', 'floor', 'obstacles', 'free']) {
    layers[name] = new THREE.Group();
    world.add(layers[name]);
  }
  layers.grid = new THREE.Group();
  layers.measure = new THREE.Group();
  scene.add(layers.grid, layers.measure);
  layers.zones.renderOrder = layers.measure.renderOrder = 1;  // drawn last, so that the map does not hide them

  const orbitCamera = new THREE.PerspectiveCamera(55, 1, 0.05, 2000);
  orbitCamera.position.set(-4, 5, 6);
  const topCamera = new THREE.OrthographicCamera(-5, 5, 5, -5, -500, 1000);
  topCamera.position.set(0, 100, 0);
  topCamera.up.set(0, 0, -1);
  topCamera.lookAt(0, 0, 0);
  const orbit = new THREE.OrbitControls(orbitCamera, renderer.domElement);
  const above = new THREE.OrbitControls(topCamera, renderer.domElement);
  orbit.enableKeys = above.enableKeys = false;
  orbit.screenSpacePanning = above.screenSpacePanning = true;
  orbit.maxDistance = 900;
  above.enableRotate = false;
  above.mouseButtons.LEFT = THREE.MOUSE.PAN;
  above.touches.ONE = THREE.TOUCH.PAN;
  above.enabled = false;
  let dirty = true, moved = 0, view = 'orbit', touched = false;
  const changed = () => { dirty = true; };
  for (const controls of [orbit, above]) {
    controls.addEventListener('change', () => { dirty = true; moved = performance.now(); });
    controls.addEventListener('start', () => { touched = true; });
  }
  const camera = () => (view === 'top' ? topCamera : orbitCamera);

  function css(name) { return getComputedStyle(document.documentElement).getPropertyValue(name).trim(); }
  function color(name) { return new THREE.Color(css('--' + name)); }
  const moverColor = (id) => new THREE.Color().setHSL((0.93 + id * 0.381966) % 1, 0.85, document.documentElement.dataset.theme === 'light' ? 0.42 : 0.66);

  // ---------------------------------------------------------------------------------------------- lines
  // Lines with a width in CSS pixels, two triangles per segment: WebGL's own lines are too thin on high-resolution screens.
  const picture = { value: new THREE.Vector3(1, 1, 1) };  // size of the canvas, and side of a drawn pixel [CSS pixels]
  function linesOf(vertices, { shade = color('text'), opacity = 1, width = 1.5, strip = false, colors = null, onTop = false } = {}) {
    const geometry = new THREE.InstancedBufferGeometry();
    const ends = (array, a, b) => {
      const buffer = new THREE.InstancedInterleavedBuffer(array, strip ? 3 : 6, 1);
      geometry.setAttribute(a, new THREE.InterleavedBufferAttribute(buffer, 3, 0));
      geometry.setAttribute(b, new THREE.InterleavedBufferAttribute(buffer, 3, 3));
    };
    ends(vertices, 'begin', 'end');
    if (colors) ends(colors, 'beginColor', 'endColor');
    geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array([0, -1, 0, 0, 1, 0, 1, -1, 0, 1, 1, 0]), 3));  // end, side
    geometry.setIndex([0, 1, 2, 2, 1, 3]);
    geometry.maxInstancedCount = Math.max(0, strip ? vertices.length / 3 - 1 : vertices.length / 6);
    const material = new THREE.RawShaderMaterial({
      uniforms: { picture, width: { value: width }, shade: { value: new THREE.Color(shade) }, opacity: { value: opacity } },
      defines: colors ? { COLORED: 1 } : {}, transparent: opacity < 1, depthTest: !onTop, side: THREE.DoubleSide,
      vertexShader: `
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
        }`,
      fragmentShader: 'precision mediump float; uniform float opacity; varying vec3 ink; void main() { gl_FragColor = vec4(ink, opacity); }',
    });
    material.color = material.uniforms.shade.value;
    const lines = new THREE.Mesh(geometry, material);
    lines.frustumCulled = false;
    return lines;
  }

  // ---------------------------------------------------------------------------------------------- cloud
  const cloudMaterial = new THREE.RawShaderMaterial({
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
  function setPalette(colors, names) {
    $('classes').replaceChildren(...names.map((name, i) => {
      const key = document.createElement('span'), patch = document.createElement('i');
      patch.className = 'patch';
      patch.style.background = `rgb(${colors[i].join()})`;
      key.append(patch, name);
      return key;
    }));
    state.classes = names.length;
    showClasses();
    dirty = true;
    const data = new Uint8Array(Math.max(1, colors.length) * 3);
    colors.forEach((c, i) => data.set(c, 3 * i));
    cloudMaterial.uniforms.palette.value = new THREE.DataTexture(data, data.length / 3, 1, THREE.RGBFormat);
    cloudMaterial.uniforms.palette.value.needsUpdate = true;
    cloudMaterial.uniforms.colors.value = data.length / 3;
  }
  function showClasses() {
    $('colors').options[2].hidden = $('colors').options[2].disabled = !state.classes;
    $('classes').hidden = $('colors').value !== '1' || !state.classes;
    $('heights').hidden = $('colors').value !== '2';
  }
  // The colors of heights, as the shader has them.
  $('heights-bar').style.background = `linear-gradient(90deg, ${[...Array(13).keys()].map((i) => {
    const part = (k) => Math.round(255 * Math.min(0.95, Math.max(0.12, 1.5 - Math.abs(i / 3 - k))));
    return `rgb(${part(3.2)}, ${part(2)}, ${part(0.8)})`;
  }).join()})`;
  setPalette([], []);

  const chunks = new Map();   // "x/y/z" -> {mesh, count, edge, shown: number of points drawn}
  const overview = new THREE.Points(new THREE.BufferGeometry(), cloudMaterial);  // a sample of all chunks in random order
  overview.frustumCulled = false;
  overview.count = 0;
  layers.cloud.add(overview);
  const staged = new Map();   // chunks that are not shown yet
  let stagedSince = 0;
  function readChunk(buffer) {
    const head = new DataView(buffer);
    const cell = [4, 8, 12].map((at) => head.getInt32(at, true));
    const count = head.getUint32(20, true);
    if (!staged.size) stagedSince = performance.now();
    staged.set(cell.join('/'), { cell, edge: head.getFloat32(16, true), count, buffer });
  }
  // A state of the map appears in one piece, so that a corrected map never overlaps with the old one for long.
  function showStaged() {
    for (const [key, chunk] of staged) {
      const old = chunks.get(key);
      if (old) {
        layers.cloud.remove(old.mesh);
        old.mesh.geometry.dispose();
        chunks.delete(key);
      }
      if (!chunk.count) continue;
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute('position', new THREE.BufferAttribute(new Uint16Array(chunk.buffer, 24, 4 * chunk.count), 4, true));
      geometry.setAttribute('color', new THREE.BufferAttribute(new Uint8Array(chunk.buffer, 24 + 8 * chunk.count, 4 * chunk.count), 4, true));
      geometry.boundingSphere = new THREE.Sphere(new THREE.Vector3(32768, 32768, 32768).divideScalar(65535), 0.87);
      const mesh = new THREE.Points(geometry, cloudMaterial);
      mesh.scale.setScalar(chunk.edge);
      mesh.position.set(...chunk.cell).multiplyScalar(chunk.edge);
      layers.cloud.add(mesh);
      chunks.set(key, { mesh, count: chunk.count, edge: chunk.edge, shown: 0 });
    }
    staged.clear();
    state.chunks = chunks.size;
    state.points = [...chunks.values()].reduce((sum, c) => sum + c.count, 0);
    $('n-points').textContent = short(state.points);
    sampleChunks();
    setHeights();
    dirty = true;
  }
  function sampleChunks() {
    const share = Math.min(1, OVERVIEW / Math.max(1, state.points)), list = [...chunks.values()].map((chunk) => [chunk, Math.ceil(share * chunk.count)]);
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
  function short(n) { return n >= 1e6 ? (n / 1e6).toFixed(2) + ' M' : n >= 1e4 ? Math.round(n / 1e3) + ' k' : String(n); }

  // Draws the first points of each chunk, more of near ones, as many as the budget allows.
  const sphere = new THREE.Sphere(), frustum = new THREE.Frustum(), matrix = new THREE.Matrix4();
  function distribute(budget) {
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
      const want = view === 'top' ? count : count * Math.min(1, (6 * edge / distance) ** 2 + 0.05);
      wanted.push([chunk, want]);
      sum += want;
    }
    const share = Math.min(1, budget / Math.max(1, sum));
    state.share = share;
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
    // Fewer points are drawn larger, so that surfaces stay closed.
    const height = renderer.domElement.height, user = Number($('size').value);
    const gap = 0.022 * user * Math.min(software ? 1.7 : 3, Math.sqrt(1 / share));
    const u = cloudMaterial.uniforms;
    u.ortho.value = view === 'top' ? 1 : 0;
    u.size.value = view === 'top' ? gap * height * topCamera.zoom / (topCamera.top - topCamera.bottom)
      : gap * height / (2 * Math.tan(orbitCamera.fov * Math.PI / 360));
  }

  // ---------------------------------------------------------------------------------------------- ground
  const ground = { up: [0, -1, 0], floor: -1.5, ceiling: 3, known: false };
  const UP_FROM = {
    rules: 'Up is that of the file of rules.',
    run: 'Up is what was given to the run, or its floor.json.',
    floor: 'Up is that of the floor that was found in the map.',
    images: 'Up is a guess: the mean upward direction of the images, for no floor is certain. The grid, the top view and drawn zones may be tilted. Give --zones FILE with up, or --planner --up X,Y,Z to the run.',
  };
  function setGround(up, floor, from) {
    ground.up = up;
    ground.floor = floor;
    state.up = up;
    state.upFrom = from;
    $('guess').hidden = from !== 'images';
    $('guess').title = UP_FROM.images;
    for (const id of ['n-grid', 'n-floor']) $(id).parentElement.title = `${UP_FROM[from]} up: [${up.join(', ')}]`;
    world.quaternion.setFromUnitVectors(new THREE.Vector3(...up), new THREE.Vector3(0, 1, 0));
    world.position.set(0, -floor, 0);
    world.updateMatrixWorld(true);
    const first = !ground.known;
    ground.known = true;
    setHeights();
    if (first || !touched) fit();
  }
  // Returns some points of the camera's path and of the map, with the floor at y = 0.
  function somePathPoints() {
    world.updateMatrixWorld(true);
    const step = Math.max(1, Math.floor(path.n / 500)), list = [];
    for (let i = path.n - 1; i >= 0; i -= step) list.push(pathPoint(i, new THREE.Vector3()).applyMatrix4(world.matrixWorld));
    return list;
  }
  function someMapPoints() {
    world.updateMatrixWorld(true);
    const list = [];
    for (const { mesh, count } of chunks.values()) {
      const p = mesh.geometry.attributes.position, step = Math.max(1, Math.floor(count / 40));
      for (let i = 0; i < count; i += step) list.push(new THREE.Vector3(p.getX(i), p.getY(i), p.getZ(i)).divideScalar(65535).applyMatrix4(mesh.matrixWorld));
    }
    return list;
  }
  function bounds() {
    const points = somePathPoints().concat(someMapPoints());
    return points.length ? new THREE.Box3().setFromPoints(points) : new THREE.Box3(new THREE.Vector3(-2, 0, -2), new THREE.Vector3(2, 2, 2));
  }
  function setHeights() {
    const box = bounds();
    ground.ceiling = Math.max(2, box.max.y);
    const highest = Math.min(6, ground.ceiling);
    cloudMaterial.uniforms.heights.value.set(0, highest);
    $('heights-top').textContent = (highest < ground.ceiling ? '> ' : '') + highest.toFixed(1) + ' m';
    setCut();
    const side = 2 * Math.ceil(Math.max(6, Math.abs(box.min.x), box.max.x, Math.abs(box.min.z), box.max.z));
    if (layers.grid.side !== side) {
      layers.grid.remove(...layers.grid.children);
      const grid = new THREE.GridHelper(side, side <= 120 ? side : side / 10, color('dim'), color('dim'));
      grid.material.transparent = true;
      grid.material.opacity = 0.22;
      grid.material.depthWrite = false;
      layers.grid.add(grid);
      layers.grid.side = side;
    }
  }
  function setCut() {
    const share = Number($('cut').value);
    cloudMaterial.uniforms.cut.value = share >= 1 ? 1e9 : share * ground.ceiling;
    $('cut-value').textContent = share >= 1 ? 'off' : (share * ground.ceiling).toFixed(1) + ' m';
    dirty = true;
  }
  // Centers the view in the area without panels. Returns the free share of the canvas in width and height.
  function arrange() {
    const box = (id) => $(id).getBoundingClientRect(), beside = !narrow.matches, right = box('frame'), below = box('timeline');
    const x = [beside ? box('layers').right : 0, beside && right.width ? right.left : innerWidth];
    const y = [box('top').bottom, below.height ? below.top : innerHeight];
    for (const e of [orbitCamera, topCamera]) e.setViewOffset(innerWidth, innerHeight, (innerWidth - x[0] - x[1]) / 2, (innerHeight - y[0] - y[1]) / 2, innerWidth, innerHeight);
    state.free = [x[0], y[0], x[1], y[1]];
    dirty = true;
    return [(x[1] - x[0]) / innerWidth, (y[1] - y[0]) / innerHeight].map((share) => Math.max(0.2, 0.92 * share));
  }
  // Shows the map up to 3 m above the floor, and the whole path of the camera, beside the panels.
  function fit() {
    const [freeWidth, freeHeight] = arrange();
    const way = somePathPoints(), map = someMapPoints().filter((p) => p.y > -0.5 && p.y < 3);
    const points = way.concat(map.length ? map : someMapPoints());
    if (!points.length) points.push(new THREE.Vector3(-2, 0, -2), new THREE.Vector3(2, 2, 2));
    const box = new THREE.Box3().setFromPoints(points), center = box.getCenter(new THREE.Vector3()), size = box.getSize(new THREE.Vector3());
    // Seen from behind the first camera, obliquely from above.
    const ahead = path.n ? new THREE.Vector3(0, 0, 1).applyQuaternion(pathRotation(0)).applyQuaternion(world.quaternion) : new THREE.Vector3(0, 0, -1);
    ahead.y = 0;
    if (ahead.length() < 0.1) ahead.set(0, 0, -1);
    const towards = ahead.normalize().multiplyScalar(-0.85).applyAxisAngle(new THREE.Vector3(0, 1, 0), 0.45).setY(0.75).normalize();
    const right = new THREE.Vector3(0, 1, 0).cross(towards).normalize(), upward = towards.clone().cross(right);
    const high = Math.tan(orbitCamera.fov * Math.PI / 360) * freeHeight, wide = high / freeHeight * orbitCamera.aspect * freeWidth;
    const distances = (list) => list.map((p) => {
      const v = p.clone().sub(center);
      return v.dot(towards) + Math.max(Math.abs(v.dot(right)) / wide, Math.abs(v.dot(upward)) / high);
    }).sort((a, b) => a - b);
    const most = distances(points.slice(way.length));  // loose points far outside may be left out
    const far = Math.max(2, ...distances(way), most[Math.floor(0.99 * (most.length - 1))] || 0);
    orbit.target.copy(center);
    orbitCamera.position.copy(center).addScaledVector(towards, far);
    orbitCamera.near = Math.max(0.02, far / 900);
    orbitCamera.far = Math.max(100, far * 20);
    orbitCamera.updateProjectionMatrix();
    orbit.update();
    const tall = Math.max(size.z / freeHeight, size.x / freeWidth / Math.max(0.2, orbitCamera.aspect));
    above.target.copy(center).setY(0);
    topCamera.position.copy(center).setY(200);
    topCamera.zoom = (topCamera.top - topCamera.bottom) / Math.max(2, tall);
    topCamera.updateProjectionMatrix();
    above.update();
    dirty = true;
  }

  // ---------------------------------------------------------------------------------------------- path
  // Frames of the path: time [s], position, rotation, state.
  const path = { n: 0, t: new Float64Array(1024), p: new Float32Array(7 * 1024), s: new Uint8Array(1024) };
  const pathPoint = (i, out) => out.set(path.p[7 * i], path.p[7 * i + 1], path.p[7 * i + 2]);
  const pathRotation = (i) => new THREE.Quaternion(path.p[7 * i + 3], path.p[7 * i + 4], path.p[7 * i + 5], path.p[7 * i + 6]);
  function pushPath(t, pose, s) {
    if (path.n === path.t.length) {
      for (const key of ['t', 'p', 's']) {
        const larger = new path[key].constructor(2 * path[key].length);
        larger.set(path[key]);
        path[key] = larger;
      }
    }
    path.t[path.n] = t;
    path.p.set(pose, 7 * path.n);
    path.s[path.n++] = s;
  }
  function readPath(buffer) {
    const head = new DataView(buffer), count = head.getUint32(4, true), first = head.getFloat64(8, true);
    const newest = path.n ? { t: path.t[path.n - 1], pose: path.p.slice(7 * path.n - 7, 7 * path.n), s: path.s[path.n - 1] } : null;
    path.n = 0;
    for (let i = 0; i < count; ++i) {
      const at = 16 + 36 * i, pose = new Float32Array(buffer, at + 4, 7);
      pushPath(first + head.getFloat32(at, true), pose, head.getUint32(at + 32, true));
    }
    if (state.live && newest && (!path.n || newest.t > path.t[path.n - 1] + 1e-4)) pushPath(newest.t, newest.pose, newest.s);
    drawPath();
    if (!state.live) setTimeline();
  }
  let pathLine = null;
  function drawPath() {
    const colors = STATES.map((name) => color(name === 'tracked' ? 'accent' : name));
    const positions = path.p, vertices = new Float32Array(3 * path.n), shades = new Float32Array(3 * path.n);
    for (let i = 0; i < path.n; ++i) {
      vertices.set(positions.subarray(7 * i, 7 * i + 3), 3 * i);
      colors[path.s[i]].toArray(shades, 3 * i);
    }
    pathLine = replaceLines(layers.path, pathLine, vertices, { width: 3, strip: true, colors: shades });
    state.path = path.n;
    let length = 0;
    for (let i = 1; i < path.n; ++i) length += Math.hypot(vertices[3 * i] - vertices[3 * i - 3], vertices[3 * i + 1] - vertices[3 * i - 2], vertices[3 * i + 2] - vertices[3 * i - 1]);
    $('n-path').textContent = path.n ? length.toFixed(1) + ' m' : '';
    dirty = true;
  }

  // ---------------------------------------------------------------------------------------------- camera
  let intrinsics = { width: 640, height: 480, fx: 525, fy: 525, cx: 320, cy: 240 };
  function corners(depth) {
    const { width, height, fx, fy, cx, cy } = intrinsics;
    return [[0, 0], [width, 0], [width, height], [0, height]].map(([u, v]) => [(u - cx) / fx * depth, (v - cy) / fy * depth, depth]);
  }
  function frustumVertices(depth) {
    const c = corners(depth), o = [0, 0, 0];
    return new Float32Array([o, c[0], o, c[1], o, c[2], o, c[3], c[0], c[1], c[1], c[2], c[2], c[3], c[3], c[0]].flat());
  }
  const eye = new THREE.Group();  // the camera now
  world.add(eye);
  const texture = new THREE.Texture();
  texture.minFilter = THREE.LinearFilter;
  texture.generateMipmaps = false;
  texture.flipY = false;
  let eyeLines = null, eyeImage = null;
  function makeEye() {
    eye.remove(...eye.children);
    eyeLines = linesOf(frustumVertices(0.45), { shade: color('relocalized') });
    const c = corners(0.45), geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array([c[0], c[1], c[2], c[3]].flat()), 3));
    geometry.setAttribute('uv', new THREE.BufferAttribute(new Float32Array([0, 0, 1, 0, 1, 1, 0, 1]), 2));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    eyeImage = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ map: texture, side: THREE.DoubleSide, transparent: true, opacity: 0.85 }));
    eyeImage.visible = false;
    eyeImage.frustumCulled = false;
    eye.add(eyeLines, eyeImage);
    eye.visible = false;
  }
  makeEye();
  function placeEye(pose, s) {
    eye.visible = true;
    eye.position.set(pose[0], pose[1], pose[2]);
    eye.quaternion.set(pose[3], pose[4], pose[5], pose[6]);
    eyeLines.material.color.copy(color(s === 1 ? 'lost' : 'relocalized'));
    placePoints();
    dirty = true;
  }
  const sight = new THREE.Vector3(), seat = new THREE.Vector3();
  let followed = 0;
  function follow() {
    if (view !== 'follow' || !eye.visible) return;
    eye.updateMatrixWorld(true);
    seat.set(0, -0.75, -2.3).applyMatrix4(eye.matrixWorld);
    sight.set(0, 0.1, 2.5).applyMatrix4(eye.matrixWorld);
    const now = performance.now(), weight = 1 - Math.exp(-Math.min(200, now - followed) / 160);
    followed = now;
    if (orbitCamera.position.distanceTo(seat) + orbit.target.distanceTo(sight) < 2e-3) return;
    orbitCamera.position.lerp(seat, weight);
    orbit.target.lerp(sight, weight);
    orbitCamera.lookAt(orbit.target);
    dirty = true;
  }

  // ---------------------------------------------------------------------------------------------- map
  let keyframeLines = null, loopLines = null, mapMessage = null;
  function drawMap(message) {
    mapMessage = message;
    const pattern = frustumVertices(0.11), n = message.keyframes.length;
    const vertices = new Float32Array(n * pattern.length), p = new THREE.Vector3(), q = new THREE.Quaternion();
    message.keyframes.forEach((pose, k) => {
      q.set(pose[3], pose[4], pose[5], pose[6]);
      for (let i = 0; i < pattern.length; i += 3) {
        p.set(pattern[i], pattern[i + 1], pattern[i + 2]).applyQuaternion(q);
        vertices.set([p.x + pose[0], p.y + pose[1], p.z + pose[2]], k * pattern.length + i);
      }
    });
    keyframeLines = replaceLines(layers.keyframes, keyframeLines, vertices, { shade: color('dim'), opacity: 0.75, width: 1 });
    // A loop joins the places of the camera at the two times.
    const at = (t) => { let i = lower(path.t, path.n, t); return i < path.n ? [path.p[7 * i], path.p[7 * i + 1], path.p[7 * i + 2]] : null; };
    const ends = [];
    for (const event of message.events) {
      const to = at(event.t), from = event.seen_in < path.n ? [...path.p.subarray(7 * event.seen_in, 7 * event.seen_in + 3)] : null;
      if (to && from) ends.push(...from, ...to);
    }
    loopLines = replaceLines(layers.loops, loopLines, new Float32Array(ends), { shade: color('loop') });
    state.keyframes = n;
    state.loops = message.events.filter((e) => e.kind !== 'dropped').length;
    $('n-keyframes').textContent = n;
    $('n-loops').textContent = state.loops;
    setGround(message.up, message.floor, message.up_from);
    placePoints();
    drawMarks();
    dirty = true;
  }
  function replaceLines(layer, old, vertices, style) {
    if (old) { layer.remove(old); old.geometry.dispose(); old.material.dispose(); }
    const lines = linesOf(vertices, style);
    layer.add(lines);
    return lines;
  }
  function lower(array, n, value) {
    let low = 0, high = n;
    while (low < high) { const middle = (low + high) >> 1; if (array[middle] < value) low = middle + 1; else high = middle; }
    return low;
  }

  // ---------------------------------------------------------------------------------------------- boxes and labels
  const EDGES = [0, 1, 1, 3, 3, 2, 2, 0, 4, 5, 5, 7, 7, 6, 6, 4, 0, 4, 1, 5, 2, 6, 3, 7];
  function boxVertices(min, max) {
    const corner = (i) => [i & 1 ? max[0] : min[0], i & 2 ? max[1] : min[1], i & 4 ? max[2] : min[2]];
    return EDGES.map(corner).flat();
  }
  const labels = new Map();
  function setLabel(key, position, html, shade, kind) {
    let label = labels.get(key);
    if (!label) {
      label = { element: document.createElement('div'), position: new THREE.Vector3() };
      label.element.className = 'label ' + kind;
      $('labels').append(label.element);
      labels.set(key, label);
    }
    label.position.set(...position);
    label.kind = kind;
    if (label.html !== html) label.element.replaceChildren(...html.map(([tag, text]) => Object.assign(document.createElement(tag), { textContent: text })));
    label.html = html;
    label.element.className = 'label ' + kind;
    label.element.style.setProperty('--color', shade);
  }
  function dropLabels(test) {
    for (const [key, label] of labels) if (test(key)) { label.element.remove(); labels.delete(key); }
  }
  const projected = new THREE.Vector3();
  function placeLabels() {
    for (const [key, label] of labels) {
      const layer = layers[key.split(':')[0]];
      projected.copy(label.position).applyMatrix4(world.matrixWorld).project(camera());
      const shown = (!layer || layer.visible) && projected.z < 1 && Math.abs(projected.x) < 1.1 && Math.abs(projected.y) < 1.1;
      label.element.style.display = shown ? '' : 'none';
      if (shown) label.element.style.transform = `translate(${((projected.x + 1) / 2 * innerWidth).toFixed(1)}px, ${((1 - projected.y) / 2 * innerHeight).toFixed(1)}px) translate(-50%, -120%)`;
    }
  }

  // ---------------------------------------------------------------------------------------------- moving objects
  const trails = new Map();   // id -> [[t, x, y, z], ...] of a live run
  let alarmed = new Set(), tracks = null, movers = new Map();  // id -> mover shown now
  function topOf(min, max) {  // the middle of a box's upper face
    const up = ground.up, axis = up.map(Math.abs).indexOf(Math.max(...up.map(Math.abs)));
    const p = min.map((low, i) => (low + max[i]) / 2);
    p[axis] = up[axis] > 0 ? max[axis] : min[axis];
    return p;
  }
  const nameOf = (m) => `${m.class === 'unknown' ? 'object' : m.class} ${m.id}`;
  // Returns the distance of a place from the box of a mover [m].
  function distanceTo(m, place) { return Math.hypot(...m.min.map((low, i) => Math.max(low - place[i], 0, place[i] - m.max[i]))); }
  function drawMovers(trailOf) {
    layers.movers.children.slice().forEach((child) => { child.geometry.dispose(); child.material.dispose(); layers.movers.remove(child); });
    const seen = new Set();
    for (const m of movers.values()) {
      const shade = alarmed.has(m.id) ? color('lost') : moverColor(m.id), speed = Math.hypot(...m.v);
      replaceLines(layers.movers, null, new Float32Array(boxVertices(m.min, m.max)), { shade, opacity: m.observed ? 1 : 0.45 });
      const trail = trailOf(m.id), pairs = [];
      for (let i = 1; i < trail.length; ++i) pairs.push(...trail[i - 1].slice(1), ...trail[i].slice(1));
      replaceLines(layers.movers, null, new Float32Array(pairs), { shade, opacity: 0.55 });
      const way = [];  // dashed: predicted
      if (speed > 0.1) for (let k = 0; k < 8; ++k) for (const part of [k / 8, (k + 0.55) / 8]) way.push(...m.p.map((x, i) => x + m.v[i] * part * PREDICTED_SECONDS));
      replaceLines(layers.movers, null, new Float32Array(way), { shade });
      setLabel('movers:' + m.id, topOf(m.min, m.max), [['span', nameOf(m) + ' '], ['small', m.observed ? `${speed.toFixed(1)} m/s` : 'predicted']], '#' + shade.getHexString(), alarmed.has(m.id) ? 'alarm' : 'mover');
      seen.add('movers:' + m.id);
    }
    dropLabels((key) => key.startsWith('movers:') && !seen.has(key));
    state.movers = movers.size;
    state.red = [...movers.keys()].filter((id) => alarmed.has(id)).length;
    $('n-movers').textContent = movers.size;
    drawBoxes();
    dirty = true;
  }
  function readMovers(message) {
    for (const m of message.movers) {
      const trail = trails.get(m.id) || [];
      if (!trail.length || m.t > trail[trail.length - 1][0]) trail.push([m.t, ...m.p]);
      while (trail.length && trail[0][0] < m.t - TRAIL_SECONDS) trail.shift();
      trails.set(m.id, trail);
    }
    movers = new Map(message.movers.map((m) => [m.id, m]));
    drawMovers((id) => trails.get(id) || []);
  }
  function readTracks(message) {
    tracks = message.tracks.map((track) => ({ ...track, times: Float64Array.from(track.samples, (s) => s.t) }));
    if (!state.live) setTimeline();
  }
  function findMovers(t) {
    movers = new Map();
    for (const track of tracks) {
      const i = lower(track.times, track.times.length, t - 1e-4), sample = track.samples[i];
      if (sample && Math.abs(sample.t - t) < 0.2) movers.set(track.id, { ...sample, id: track.id, class: track.class });
    }
  }
  function drawMoversAt(t) {
    drawMovers((id) => {
      const track = tracks.find((x) => x.id === id);
      return track.samples.slice(lower(track.times, track.times.length, t - TRAIL_SECONDS), lower(track.times, track.times.length, t + 1e-4)).map((s) => [s.t, ...s.p]);
    });
  }

  function drawObjects(objects) {
    layers.objects.remove(...layers.objects.children);
    dropLabels((key) => key.startsWith('objects:'));
    for (const object of objects || []) {
      const unsure = object.confidence < UNSURE;
      replaceLines(layers.objects, null, new Float32Array(boxVertices(object.box.min, object.box.max)), { shade: color('object'), opacity: unsure ? 0.2 : 0.6, width: unsure ? 1 : 1.5 });
      setLabel('objects:' + object.id, topOf(object.box.min, object.box.max), unsure ? [['span', object.class + '? '], ['small', `${Math.round(100 * object.confidence)} %`]] : [['span', object.class]], css('--object'), unsure ? 'object unsure' : 'object');
    }
    state.objects = (objects || []).length;
    $('n-objects').textContent = state.objects;
    dirty = true;
  }

  // ---------------------------------------------------------------------------------------------- zones and warnings
  function drawZones(zones) {
    layers.zones.remove(...layers.zones.children);
    dropLabels((key) => key.startsWith('zones:'));
    zones.forEach((zone, k) => {
      const up = zone.up || ground.up, at = (p, h) => p.map((x, i) => x + up[i] * h), pairs = [], faces = [];
      zone.polygon.forEach((p, i) => {
        const next = zone.polygon[(i + 1) % zone.polygon.length], [low, high] = zone.height;
        const a = at(p, low), b = at(next, low), c = at(next, high), d = at(p, high);
        pairs.push(...a, ...b, ...d, ...c, ...a, ...d);
        faces.push(...a, ...b, ...c, ...a, ...c, ...d);
      });
      const shade = alarmed.has('zone:' + zone.name) ? color('lost') : color('zone');
      replaceLines(layers.zones, null, new Float32Array(pairs), { shade, onTop: true });
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(faces), 3));
      const mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ color: shade, transparent: true, opacity: unseen.has(zone.name) ? 0.03 : 0.13, side: THREE.DoubleSide, depthWrite: false }));
      mesh.frustumCulled = false;
      layers.zones.add(mesh);
      const center = zone.polygon.reduce((sum, p) => sum.map((x, i) => x + p[i] / zone.polygon.length), [0, 0, 0]);
      setLabel('zones:' + k, at(center, zone.height[1]), unseen.has(zone.name) ? [['span', zone.name + ' '], ['small', 'not in view']] : [['span', zone.name]], css('--zone'), 'object');
    });
    state.zones = zones.length;
    $('n-zones').textContent = zones.length;
    dirty = true;
  }
  // Floor, obstacles and free space of the files for planners. Their frame `map` has z up, and its floor is z = 0.
  let planner = null;
  const FREE = 1, OCCUPIED = 2;  // values of cells
  function drawPlanner(message) {
    planner = state.planner = message;
    for (const layer of [layers.floor, layers.obstacles, layers.free]) layer.remove(...layer.children);
    dirty = true;
    if (!planner) return;
    const { grid, obstacles, T_map_world: T } = planner, shade = color('obstacle');
    const turn = new THREE.Quaternion(T[3], T[4], T[5], T[6]).conjugate(), place = new THREE.Vector3(-T[0], -T[1], -T[2]).applyQuaternion(turn);
    for (const layer of [layers.floor, layers.obstacles, layers.free]) {
      layer.quaternion.copy(turn);
      layer.position.copy(place);
    }
    const area = (value) => grid.cells.reduce((sum, x, i) => sum + (i % 2 && grid.cells[i - 1] === value ? x : 0), 0) * grid.resolution ** 2;
    const [width, depth] = [grid.width * grid.resolution, grid.height * grid.resolution];
    layers.floor.add(linesOf(outlineOf(grid.origin, width, depth), { shade: color('dim'), width: 2 }), linesOf(meterLines(grid.origin, width, depth), { shade: color('dim'), opacity: 0.4, width: 1 }));
    layers.obstacles.add(cellsOf(grid, OCCUPIED, shade, 0.6), linesOf(new Float32Array(obstacles.flatMap(obstacleEdges)), { shade }));
    layers.free.add(cellsOf(grid, FREE, color('good'), 0.3));
    $('n-floor').textContent = `${width.toFixed(1)} × ${depth.toFixed(1)} m`;
    $('n-obstacles').textContent = obstacles.length;
    $('n-free').textContent = area(FREE).toFixed(1) + ' m²';
  }
  function outlineOf([x, y], width, depth) {
    const corners = [[x, y, 0], [x + width, y, 0], [x + width, y + depth, 0], [x, y + depth, 0]];
    return new Float32Array(corners.flatMap((corner, i) => [...corner, ...corners[(i + 1) % 4]]));
  }
  // Returns the lines at whole meters in a rectangle.
  function meterLines([x, y], width, depth) {
    const lines = [];
    for (let k = Math.ceil(x); k <= x + width; ++k) lines.push(k, y, 0, k, y + depth, 0);
    for (let k = Math.ceil(y); k <= y + depth; ++k) lines.push(x, k, 0, x + width, k, 0);
    return new Float32Array(lines);
  }
  function obstacleEdges({ center, size, yaw }) {
    const half = size.map((side) => side / 2), edges = boxVertices(half.map((side) => -side), half);
    for (let i = 0; i < edges.length; i += 3) {
      const [x, y] = [edges[i], edges[i + 1]];
      edges[i] = center[0] + x * Math.cos(yaw) - y * Math.sin(yaw);
      edges[i + 1] = center[1] + x * Math.sin(yaw) + y * Math.cos(yaw);
      edges[i + 2] += center[2];
    }
    return edges;
  }
  // Returns the cells of a value as one image on the floor. The first row of the grid has the highest y.
  function cellsOf(grid, value, shade, opacity) {
    const { width, height, resolution, origin, cells } = grid, image = new Uint8Array(4 * width * height);
    const ink = [...shade.toArray().map((x) => Math.round(255 * x)), 255];
    for (let i = 0, at = 0; i < cells.length; at += cells[i + 1], i += 2) {
      if (cells[i] !== value) continue;
      for (let k = at; k < at + cells[i + 1]; ++k) image.set(ink, 4 * ((height - 1 - Math.floor(k / width)) * width + k % width));
    }
    const texture = new THREE.DataTexture(image, width, height, THREE.RGBAFormat);
    texture.needsUpdate = true;
    const material = new THREE.MeshBasicMaterial({ map: texture, transparent: true, opacity, side: THREE.DoubleSide, depthWrite: false });
    const mesh = new THREE.Mesh(new THREE.PlaneBufferGeometry(width * resolution, height * resolution), material);
    mesh.position.set(origin[0] + width * resolution / 2, origin[1] + height * resolution / 2, 0.01);
    return mesh;
  }
  // Points that move with the camera, with the distances of their rules: a sphere, or a cylinder if they are level. 0 m: the point alone.
  let points = [];
  function drawPoints(list) {
    layers.points.remove(...layers.points.children);
    dropLabels((key) => key.startsWith('points:'));
    const ring = (radius, turn, dim) => {
      const circle = [...Array(65).keys()].flatMap((i) => [radius * Math.cos(i * Math.PI / 32), 0, radius * Math.sin(i * Math.PI / 32)]);
      const line = linesOf(new Float32Array(circle), { strip: true, opacity: dim ? 0.25 : 0.6 });
      line.rotation.set(turn === 'x' ? Math.PI / 2 : 0, 0, turn === 'z' ? Math.PI / 2 : 0);
      return line;
    };
    const cross = (r) => linesOf(new Float32Array([-r, 0, 0, r, 0, 0, 0, -r, 0, 0, r, 0, 0, 0, -r, 0, 0, r]));
    points = list.map((point) => {
      const group = new THREE.Group(), below = new THREE.Group();  // `below`: on the floor
      group.add(cross(0.12), ring(point.nearer, 'y'));
      if (point.level) {
        below.add(ring(point.nearer, 'y'), cross(0.12));
        const plumb = linesOf(new Float32Array([0, 0, 0, 0, 1, 0]), { opacity: 0.6 });
        plumb.name = 'plumb';
        group.add(below, plumb);
      } else group.add(ring(point.nearer, 'x', true), ring(point.nearer, 'z', true));
      layers.points.add(group);
      return { ...point, group, below };
    });
    state.rings = points.length;
    $('n-rings').textContent = points.length;
    placePoints();
    colorPoints();
  }
  function placePoints() {
    for (const point of points) {
      point.group.visible = eye.visible;
      if (!eye.visible) continue;
      point.group.position.set(...point.offset).applyQuaternion(eye.quaternion).add(eye.position);
      point.group.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), new THREE.Vector3(...ground.up));
      const above = new THREE.Vector3(...ground.up).dot(point.group.position) - ground.floor, plumb = point.group.getObjectByName('plumb');
      point.below.position.set(0, -above, 0);
      if (plumb) plumb.scale.set(1, -above || 1e-3, 1);
      if (point.name !== 'camera') setLabel('points:' + (point.rule || point.name), point.group.position.toArray(), [['span', point.name + ' '], ['small', point.nearer ? point.nearer + ' m' : '']], css('--zone'), 'object');
    }
    dirty = true;
  }
  function colorPoints() {
    for (const point of points) {
      const shade = color(alarmed.has('point:' + point.rule) ? 'lost' : 'zone');
      point.group.traverse((part) => { if (part.material) part.material.color.copy(shade); });
    }
    dirty = true;
  }

  let zones = [], drawn = [], unseen = new Set(), sound = false, audio = null;
  let active = [], expanded = false, soundAsked = false, known = new Set();  // known: keys of the warnings shown last
  // Names a warning apart from the distances in its text.
  const keyOf = (w) => [w.kind, w.rule || w.zone || '', w.mover || '', w.text.replace(/\d+\.\d+/g, '')].join('|');
  function showWarnings(message) {
    const all = message.active || [];
    active = all.filter((w) => w.kind !== 'unseen');
    const keys = new Set(active.map(keyOf)), begins = active.some((w) => !known.has(keyOf(w)));
    known = keys;
    alarmed = new Set(active.flatMap((w) => [w.mover, w.zone && 'zone:' + w.zone, /near|course/.test(w.kind) && 'point:' + w.rule].filter(Boolean)));
    unseen = new Set(all.filter((w) => w.kind === 'unseen').map((w) => w.zone));
    state.warnings = message.count;
    state.active = active.length;
    if (sound && begins) beep();
    drawBanners();
    drawZones(zones);
    colorPoints();
  }
  // What the page itself cannot know: whether the program still runs, and what it sees now.
  let heard = 0, closed = 0;  // times of the newest image and of the end of the connection
  // Least latency so far, which contains the difference of the clocks, and that of the newest image above it [ms].
  let fastest = Infinity, late = 0;
  function unknownNow() {
    if (state.refused) return state.refused;
    if (!state.live) return '';
    const seconds = (from) => Math.floor((performance.now() - from) / 1000) + ' s';
    if (!state.connected) return `not known: no connection for ${seconds(closed)}`;
    if (performance.now() - heard > SILENCE_MS) return `not known: no image for ${seconds(heard)}`;
    return late > SILENCE_MS ? `not known: this page is ${(late / 1000).toFixed(1)} s late` : '';
  }
  let bannerKey = '';
  // Returns lists of warnings: one per moving object, and one for each warning without one.
  function byMover(warnings) {
    const groups = new Map();
    warnings.forEach((w, i) => { const key = w.mover || 'warning ' + i; groups.set(key, (groups.get(key) || []).concat([w])); });
    return [...groups.values()];
  }
  // Returns the present distance of a mover from the camera, or else that of its warning [m].
  function farNow(w) {
    if (movers.has(w.mover) && eye.visible) return distanceTo(movers.get(w.mover), eye.position.toArray());
    return w.distance === undefined ? Infinity : w.distance;
  }
  // Returns one text per moving object, the nearest first. The texts of a finished run tell distances of other times.
  function bars() {
    return byMover(active).sort((a, b) => farNow(a[0]) - farNow(b[0])).map((warnings) => ({
      unknown: warnings[0].kind === 'unknown', text: state.live ? liveText(warnings) : recordedText(warnings, farNow(warnings[0])) }));
  }
  // Returns the first names and the number of the others; a single other one is named.
  const firstOf = (names, most) => (names.length > most + 1 ? `${names.slice(0, most).join(', ')} and ${names.length - most} more` : names.join(', '));
  const rulesOf = (warnings) => [...new Set(warnings.map((w) => w.rule))];
  // Returns the first warning, and the other rules that the mover breaks.
  function liveText([first, ...others]) {
    const more = rulesOf(others).filter((rule) => rule && rule !== first.rule);
    return first.text + (more.length ? '; also: ' + firstOf(more, 2) : '');
  }
  // Returns the mover with a distance, and the rules that it breaks: "person 3, 1.2 m away: caution, gate".
  function recordedText(warnings, distance) {
    const [{ mover, text }] = warnings;
    if (!mover) return text;
    const [who] = text.match(mover > 0 ? new RegExp(`\\S+ ${mover}\\b`) : /\S+(?= is | will be )/) || ['object'];
    return `${who}${distance === Infinity ? '' : `, ${distance.toFixed(1)} m away`}: ${firstOf(rulesOf(warnings), 3)}`;
  }
  // The nearest warnings first; above them a bar if the state is unknown.
  function drawBanners() {
    const unknown = unknownNow(), most = expanded ? Infinity : narrow.matches ? 2 : 5;
    const age = Math.floor((performance.now() - (state.connected ? heard - late : closed)) / 1000);
    const all = bars(), old = unknown && state.live;
    const lines = all.slice(0, most).map((bar) => ({ type: 'div', kind: 'warning' + (bar.unknown ? ' unknown' : '') + (old ? ' old' : ''), text: bar.text + (old ? ` (${age} s ago)` : '') }));
    const more = all.length - lines.length, begins = unknown && !state.unknown;
    if (unknown) lines.unshift({ type: 'div', kind: 'warning unknown', text: unknown });
    if (more > 0 || expanded) lines.push({ type: 'button', kind: 'more', text: expanded ? 'show fewer' : `+${more} more`, action: () => { expanded = !expanded; drawBanners(); } });
    if (state.live && !sound && !soundAsked && (active.length || unknown)) lines.push({ type: 'button', kind: 'more', text: '♪ sound is off: turn it on', action: () => $('sound').click() });
    state.unknown = unknown;
    state.banners = lines.filter((line) => line.type === 'div').map((line) => line.text);
    state.more = more;
    document.body.classList.toggle('alarm', active.some((w) => w.kind !== 'unknown'));
    document.body.classList.toggle('unknown', Boolean(unknown));
    if (sound && begins) beep();
    if (unknown && state.live) { $('state').textContent = !state.connected ? 'connection lost' : performance.now() - heard > SILENCE_MS ? 'no image' : 'late'; $('state').className = 'pill lost'; }
    const key = lines.map((line) => line.kind + line.text).join('\n');
    if (key === bannerKey) return;
    bannerKey = key;
    $('warnings').replaceChildren(...lines.map((line) => {
      const element = Object.assign(document.createElement(line.type), { className: line.kind, textContent: line.text });
      if (line.action) element.addEventListener('click', line.action);
      return element;
    }));
  }
  setInterval(drawBanners, 250);
  // All warnings of a finished run: marks below the time slider, and a list with one entry per moving object.
  let events = [], shownEvents = '';
  function readEvents(message) {
    events = message.events;
    state.events = events.length;
    shownEvents = null;
    if (!state.live) setTimeline();
  }
  // Returns when a mover was nearest to the camera while one of its warnings lasted, and how near [m].
  function nearestOf(warnings) {
    const track = (tracks || []).find((x) => x.id === warnings[0].mover);
    const nearest = { t: warnings[0].begin, distance: Math.min(...warnings.map((w) => (w.distance === undefined ? Infinity : w.distance))) };
    for (const sample of track ? track.samples : []) {
      if (!warnings.some((w) => isActive(w, sample.t))) continue;
      const i = Math.min(path.n - 1, lower(path.t, path.n, sample.t - 1e-4)), distance = distanceTo(sample, [...path.p.subarray(7 * i, 7 * i + 3)]);
      if (distance < nearest.distance) Object.assign(nearest, { t: sample.t, distance });
    }
    return nearest;
  }
  // Lists the movers with warnings, the nearest first; a click shows when it was nearest.
  let entries = [];
  function listWarnings() {
    entries = byMover(events).map((warnings) => ({ warnings, ...nearestOf(warnings) })).sort((a, b) => a.distance - b.distance || a.t - b.t);
    $('events-title').hidden = !events.length;
    $('events').replaceChildren(...entries.map(({ warnings, t, distance }) => {
      const button = Object.assign(document.createElement('button'), { className: warnings[0].kind, textContent: recordedText(warnings, distance) });
      button.dataset.time = secondsText(t);
      button.addEventListener('click', () => { play(false); showTime(t); });
      return button;
    }));
    state.entries = [...$('events').children].map((button) => button.textContent);
  }
  const isActive = (event, t) => event.begin <= t + 1e-4 && (event.end === null || t < event.end - 1e-4);
  function eventsAt(t) {
    const now = events.filter((e) => isActive(e, t)), key = now.map((e) => events.indexOf(e)).join();
    if (!events.length || key === shownEvents) return;
    shownEvents = key;
    [...$('events').children].forEach((button, i) => button.classList.toggle('on', entries[i].warnings.some((w) => now.includes(w))));
    showWarnings({ active: now.map((e) => ({ ...e, mover: e.mover || undefined, zone: /zone|unseen/.test(e.kind) ? e.rule : undefined })), count: events.length });
  }
  function stepEvent(direction) {
    const times = events.filter((e) => e.kind !== 'unseen').map((e) => e.begin);
    const next = direction > 0 ? times.find((t) => t > now + 0.01) : times.reverse().find((t) => t < now - 0.01);
    if ($('timeline').hidden || next === undefined) return;
    play(false);
    showTime(next);
  }
  function beep() {
    audio = audio || new AudioContext();
    const tone = audio.createOscillator(), level = audio.createGain();
    tone.frequency.value = 880;
    level.gain.setValueAtTime(0.15, audio.currentTime);
    level.gain.exponentialRampToValueAtTime(0.001, audio.currentTime + 0.4);
    tone.connect(level).connect(audio.destination);
    tone.start();
    tone.stop(audio.currentTime + 0.4);
  }

  // ---------------------------------------------------------------------------------------------- frame
  let run = {};
  const msText = (x) => (x >= 1000 ? (x / 1000).toFixed(1) + ' s' : (x < 10 ? x.toFixed(1) : Math.round(x)) + ' ms');
  function readFrame(message) {
    state.frame = message.index;
    state.frames += 1;
    heard = performance.now();
    state.latency = Date.now() - message.wall;
    fastest = Math.min(fastest, state.latency);
    late = state.latency - fastest;
    if (message.pose) {
      if (!path.n || message.t > path.t[path.n - 1]) pushPath(message.t, message.pose, message.state);
      placeEye(message.pose, message.state);
    } else if (path.n) {
      placeEye(path.p.subarray(7 * path.n - 7, 7 * path.n), 1);
    }
    $('state').textContent = message.state === 1 ? 'camera lost' : message.state === 2 ? 'relocalized' : 'live';
    $('state').className = 'pill ' + (message.state === 1 ? 'lost' : 'live');
    $('clock').textContent = `frame ${message.index + 1}${run.frames ? ' of ' + run.frames : ''}`;
    $('reason').textContent = message.reason;
    const ms = message.ms, total = ms.features + ms.masks + ms.motion + ms.pose, shed = message.shed;
    showStats([
      ['tracking', msText(total), total > 33], ['latency', msText(Math.max(0, state.latency)), false],
      ['coverage', (100 * message.tracked / (message.index + 1)).toFixed(1) + ' %', message.tracked < 0.95 * (message.index + 1)], ['waiting', msText(ms.waiting), false],
      ['keypoints', message.keypoints, false], ['moving', message.moving, false],
      ['inliers', message.inliers, message.inliers < 30], ['mask age', message.mask_age < 0 ? '–' : message.mask_age, message.mask_age > 10],
      ...(message.dynamics ? [['dynamics', message.dynamics === 2 ? 'high' : 'low', false]] : []),
      ['no movers', shed.without_movers, shed.without_movers > 0], ['no view', shed.without_view, shed.without_view > 0],
      ['fewer keyp.', shed.fewer_keypoints, shed.fewer_keypoints > 0],
    ]);
    showTimes(ms);
    addDynamics(message.t, message.dynamics === 2);
  }
  const WORDS = {
    tracking: 'time to track the newest frame; the median on a finished run', latency: 'time from the program to this page, by the clocks of both computers',
    coverage: 'share of the frames with a pose of the camera', waiting: 'time that the frame waited for a free thread',
    keypoints: 'points found in the image', moving: 'keypoints on moving objects', inliers: 'keypoints that agree with the pose of the camera',
    'mask age': 'age of the newest result of the network [frames]', 'no movers': 'frames whose moving objects were not looked for, since the computer was too slow',
    'no view': 'frames that were not added to the map, since the computer was too slow', 'fewer keyp.': 'frames with fewer keypoints, since the computer was too slow',
    dynamics: 'whether the scene is highly dynamic, so that keypoints on people are removed (preset gated-seg)', landmarks: 'points of the map that the camera is located with', keyframes: 'frames that the map is made of', loops: 'places that were recognized, which corrected the map',
    relocalized: 'frames in which a lost camera found its place again', maps: 'parts of the map that are not connected', 'ATE RMSE': 'absolute trajectory error against the true trajectory',
    preset: 'the set of options of the run', 'points drawn': 'points of the map in this picture; all are drawn when it rests',
  };
  $('words').replaceChildren(...Object.entries(WORDS).flatMap(([word, meaning]) => [
    Object.assign(document.createElement('dt'), { textContent: word }), Object.assign(document.createElement('dd'), { textContent: meaning })]));
  function showStats(rows) {
    $('stats').replaceChildren(...rows.flatMap(([name, value, bad]) => [
      Object.assign(document.createElement('span'), { textContent: name, title: WORDS[name] || '' }),
      Object.assign(document.createElement('b'), { textContent: value, className: bad ? 'bad' : '', title: WORDS[name] || '' })]));
  }
  let bar = null;
  function showTimes(ms) {
    if (!bar) {
      bar = {};
      const strip = Object.assign(document.createElement('div'), { className: 'bar' }), keys = Object.assign(document.createElement('div'), { className: 'bar-keys' });
      for (const [name, shade] of Object.entries(STAGES)) {
        const part = document.createElement('i'), key = document.createElement('span'), patch = document.createElement('i'), text = document.createElement('span');
        part.style.background = patch.style.background = shade;
        key.append(patch, text);
        strip.append(part);
        keys.append(key);
        bar[name] = { part, text };
      }
      $('times').append(strip, keys);
    }
    const most = Math.max(33, Object.keys(STAGES).reduce((sum, name) => sum + ms[name], 0));
    for (const name of Object.keys(STAGES)) {
      bar[name].part.style.width = (100 * ms[name] / most) + '%';
      bar[name].text.textContent = `${name} ${ms[name].toFixed(1)}`;
    }
  }
  let imageUrl = null;
  async function readImage(buffer) {
    showImage(new Blob([new Uint8Array(buffer, 8)], { type: 'image/jpeg' }));
    $('frame-number').textContent = new DataView(buffer).getUint32(4, true);
  }
  function showImage(blob) {
    const old = imageUrl;
    imageUrl = URL.createObjectURL(blob);
    $('image').src = imageUrl;
    if (old) URL.revokeObjectURL(old);
    state.images += 1;
  }
  // Shows or hides the image, and says why there is none.
  function setNoImage(reason) {
    state.noImage = reason;
    $('no-image').textContent = reason;
    $('figure').hidden = Boolean(reason);
    for (const keys of document.querySelectorAll('.image-keys')) keys.hidden = Boolean(reason) || !state.live;
    if (reason) eyeImage.visible = false;
  }
  // Asks for the image of a finished run at a time. While one is on its way, only the newest time is remembered.
  let noImages = null, wanted = null, asking = false;  // noImages: why there are none; null: not known
  async function askImage(t) {
    wanted = t;
    if (asking || noImages !== '') return;
    asking = true;
    while (wanted !== null) {
      const query = new URLSearchParams(location.search);
      query.set('t', wanted);
      wanted = null;
      try {
        const answer = await fetch('/image?' + query);
        if (answer.ok) showImage(await answer.blob());
        setNoImage(answer.ok ? '' : await answer.text());
      } catch (e) {
        setNoImage('No image: no connection.');
      }
    }
    asking = false;
  }
  function readImages(message) {
    noImages = message.problem;
    setNoImage(noImages);
    if (path.n) askImage(path.t[Math.min(path.n - 1, lower(path.t, path.n, now - 1e-4))]);
  }
  // Outlines the movers in the image, with the numbers that they have on the map and in the warnings.
  function drawBoxes() {
    const image = $('image'), large = $('figure').classList.contains('large'), { width, height } = intrinsics, shapes = [];
    const fits = image.naturalWidth && Math.abs(image.naturalWidth / image.naturalHeight * height / width - 1) < 0.02;
    $('boxes').setAttribute('viewBox', `0 0 ${width} ${height}`);
    state.boxes = [];
    for (const m of fits && eye.visible ? movers.values() : []) {
      const box = boxInImage(m);
      if (!box) continue;
      const shade = alarmed.has(m.id) ? css('--lost') : '#' + moverColor(m.id).getHexString(), size = height / (large ? 40 : narrow.matches ? 15 : 22);
      const text = `${nameOf(m)}, ${distanceTo(m, eye.position.toArray()).toFixed(1)} m`;
      shapes.push(svg('rect', { x: box.left, y: box.top, width: box.right - box.left, height: box.bottom - box.top, stroke: shade, 'stroke-dasharray': m.observed ? '' : '6 4' }));
      shapes.push(Object.assign(svg('text', { x: Math.min(box.left + 4, width - 9 * size), y: box.bottom - 6, 'font-size': size }), { textContent: text }));
      state.boxes.push(text);
    }
    $('boxes').replaceChildren(...shapes);
  }
  function svg(name, attributes) {
    const element = document.createElementNS('http://www.w3.org/2000/svg', name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    return element;
  }
  // Returns the part of the image that the box of a mover takes; null if it is out of view.
  function boxInImage(m) {
    const { width, height, fx, fy, cx, cy } = intrinsics, turn = eye.quaternion.clone().conjugate(), u = [], v = [];
    for (let k = 0; k < 8; ++k) {
      const p = new THREE.Vector3(...[0, 1, 2].map((i) => (k >> i & 1 ? m.max : m.min)[i])).sub(eye.position).applyQuaternion(turn);
      const z = Math.max(0.1, p.z);
      if (p.z > 0) { u.push(cx + fx * p.x / z); v.push(cy + fy * p.y / z); }
    }
    if (!u.length) return null;
    const within = (x, most) => Math.min(most, Math.max(0, x));
    const box = { left: within(Math.min(...u), width), right: within(Math.max(...u), width), top: within(Math.min(...v), height), bottom: within(Math.max(...v), height) };
    return box.right > box.left && box.bottom > box.top ? box : null;
  }
  $('image').addEventListener('load', () => {
    texture.image = $('image');
    texture.needsUpdate = true;
    eyeImage.visible = true;
    drawBoxes();
    dirty = true;
  });

  function showSummary(content) {
    summary = content;
    const frames = summary.frames || {}, evaluation = summary.evaluation || {};
    const rows = [['frames', frames.total, false], ['tracked', frames.tracked, false], ['keyframes', summary.keyframes, false], ['landmarks', summary.landmarks, false],
      ['tracking', summary.tracking_median_ms === undefined ? undefined : msText(summary.tracking_median_ms), false], ['maps', summary.maps, summary.maps > 1],
      ['loops', (summary.loops || []).length, false], ['relocalized', (summary.relocalizations || []).length, false]];
    if (frames.total && frames.tracked) rows.push(['coverage', (100 * frames.tracked / frames.total).toFixed(1) + ' %', frames.tracked < 0.95 * frames.total]);
    if (evaluation.ate) rows.push(['ATE RMSE', (100 * evaluation.ate.translation_m.rmse).toFixed(1) + ' cm', false]);
    if (frames.highly_dynamic !== null && frames.highly_dynamic !== undefined) rows.push(['dynamics', `high ${Math.round(100 * frames.highly_dynamic / frames.total)} %`, false]);
    highPeriods = frames.highly_dynamic_periods || [];
    showFindings(summary.doubts || []);
    drawMarks();
    if (summary.preset) rows.push(['preset', summary.preset, false]);
    showStats(rows.filter((row) => row[1] !== undefined));
  }
  function showFindings(doubts) {
    state.findings = doubts.length;
    $('findings-title').hidden = !doubts.length;
    $('findings').replaceChildren(...doubts.map((text) => Object.assign(document.createElement('p'), { textContent: text })));
  }

  // ---------------------------------------------------------------------------------------------- time line
  let playing = false, now = 0, summary = {};
  let highPeriods = []; // [begin, end] of the highly dynamic periods of preset gated-seg [s]
  // Remembers the verdict of the gate on a frame of a run in progress.
  function addDynamics(t, high) {
    const last = highPeriods[highPeriods.length - 1];
    if (last && last.open) last[1] = t;
    if (last && last.open && !high) last.open = false;
    if (high && !(last && last.open)) highPeriods.push(Object.assign([t, t], { open: true }));
  }
  // A finished run is shown from its start; a run that was watched live stays at its end.
  function setTimeline(t = $('timeline').hidden ? path.t[0] : now) {
    if (!path.n) return;
    $('timeline').hidden = false;
    $('time').min = path.t[0];
    $('time').max = path.t[path.n - 1];
    $('time').step = 0.001;
    listWarnings();
    showTime(t);
    drawMarks();
  }
  function showTime(t) {
    now = Math.min(path.t[path.n - 1], Math.max(path.t[0], t));
    const i = Math.min(path.n - 1, lower(path.t, path.n, now - 1e-4));
    placeEye(path.p.subarray(7 * i, 7 * i + 7), path.s[i]);
    $('time').value = now;
    $('time-value').textContent = `${(now - path.t[0]).toFixed(1)} / ${(path.t[path.n - 1] - path.t[0]).toFixed(1)} s`;
    $('clock').textContent = STATES[path.s[i]] === 'lost' ? 'camera lost' : '';
    if (tracks) findMovers(now);
    eventsAt(now);
    if (tracks) drawMoversAt(now);
    askImage(path.t[i]);
    state.time = now;
  }
  function play(on) {
    playing = on;
    $('play').textContent = on ? '❚❚' : '▶';
    if (on && now >= path.t[path.n - 1] - 0.05) showTime(path.t[0]);
    dirty = true;
  }
  const secondsText = (t) => `${(t - (path.n ? path.t[0] : 0)).toFixed(1)} s`;
  // Returns the marks of the camera: its states, and the places where the map was corrected or it found its place again.
  function cameraMarks() {
    const shades = STATES.map((name) => css(name === 'tracked' ? '--accent' : '--' + name)), marks = [];
    for (let i = 0; i < path.n; ++i) {
      const last = marks[marks.length - 1], text = STATES[path.s[i]], begin = path.t[i];
      if (last) last.end = begin;
      if (!last || last.text !== text) marks.push({ begin, end: begin, text, shade: shades[path.s[i]], faint: path.s[i] === 0 });
    }
    for (const event of mapMessage ? mapMessage.events : []) marks.push({ begin: event.t, end: event.t, text: EVENTS[event.kind], shade: css('--loop') });
    return marks;
  }
  const EVENTS = { loop: 'loop closed', merge: 'maps joined', dropped: 'map dropped' };
  function warningMarks() {
    const end = path.t[path.n - 1], shade = (kind) => css({ unknown: '--relocalized', unseen: '--dim' }[kind] || '--lost');
    return events.map((e) => ({ begin: e.begin, end: e.end === null ? end : e.end, text: e.text, shade: shade(e.kind), faint: true }));
  }
  // Returns the marks of the findings: the doubts about the whole run, and the frames that they may be due to.
  function findingMarks() {
    const frames = summary.frames || {}, at = (t, text) => ({ begin: t, end: t, text, shade: css('--relocalized') });
    return (summary.doubts || []).map((text) => ({ ...at(path.t[0], text), end: path.t[path.n - 1], faint: true }))
      .concat((summary.skipped || []).map((skipped) => at(skipped.timestamp, skipped.reason)), (frames.uncertain_at || []).map((t) => at(t, 'uncertain pose')));
  }
  function dynamicsMarks() {
    return highPeriods.map(([begin, end]) => ({ begin, end, text: 'highly dynamic: keypoints on people are removed', shade: css('--odometry') }));
  }
  const ROW = 10;  // height of a row of the time line [CSS pixels]
  let rows = [];   // of the time line: {name, marks}
  // Draws the time line below the slider. Faint marks are drawn first, since other marks lie on them.
  function drawMarks() {
    if ($('timeline').hidden || path.n < 2) return;
    rows = [['camera', cameraMarks()], ['warnings', warningMarks()], ['findings', findingMarks()], ['dynamics', dynamicsMarks()]]
      .map(([name, marks]) => ({ name, marks: marks.sort((a, b) => Boolean(b.faint) - Boolean(a.faint)) })).filter((row) => row.marks.length);
    $('rows').replaceChildren(...rows.map((row) => Object.assign(document.createElement('span'), { textContent: row.name })));
    const canvas = $('marks'), ink = canvas.getContext('2d'), scale = devicePixelRatio, width = Math.max(100, canvas.clientWidth);
    canvas.style.height = rows.length * ROW + 'px';
    canvas.width = width * scale;
    canvas.height = rows.length * ROW * scale;
    ink.scale(scale, scale);
    const x = (t) => width * (t - path.t[0]) / (path.t[path.n - 1] - path.t[0]);
    rows.forEach((row, k) => {
      for (const { begin, end, shade, faint } of row.marks) {
        ink.globalAlpha = faint ? 0.35 : 1;
        ink.fillStyle = shade;
        ink.fillRect(x(begin) - 1, k * ROW + 2, Math.max(2, x(end) - x(begin)), ROW - 3);
      }
    });
    state.rows = Object.fromEntries(rows.map((row) => [row.name, row.marks.length]));
  }
  // Describes the marks below the pointer on the time line.
  function showHint(event) {
    const box = $('marks').getBoundingClientRect(), row = rows[Math.floor((event.clientY - box.top) / ROW)];
    const time = (x) => path.t[0] + (x - box.left) / box.width * (path.t[path.n - 1] - path.t[0]), near = 4;  // [pixels]
    const marks = row ? row.marks.filter((mark) => mark.begin <= time(event.clientX + near) && mark.end >= time(event.clientX - near)).reverse() : [];
    const texts = [...new Set(marks.map((mark) => mark.text))];
    const more = texts.length > 4 ? [`and ${texts.length - 4} more`] : [];
    state.hint = texts.length ? [`${row.name}, ${secondsText(time(event.clientX))}`, ...texts.slice(0, 4), ...more].join('\n') : '';
    $('hint').textContent = state.hint;
    $('hint').hidden = !state.hint;
    $('hint').style.left = Math.min(innerWidth - $('hint').offsetWidth - 8, Math.max(8, event.clientX - $('hint').offsetWidth / 2)) + 'px';
    return time(event.clientX);
  }

  // ---------------------------------------------------------------------------------------------- measuring and zones
  let tool = null, picked = [];
  const ray = new THREE.Raycaster();
  // Returns the drawn point nearest to the viewer within a few pixels of a position on the screen; null without one.
  function pickPoint(x, y) {
    const e = camera();
    ray.setFromCamera(new THREE.Vector2(2 * x / innerWidth - 1, 1 - 2 * y / innerHeight), e);
    const best = { distance: Infinity, point: null }, p = new THREE.Vector3(), pixel = 2 * Math.tan(orbitCamera.fov * Math.PI / 360) / innerHeight;
    for (const { mesh, shown } of chunks.values()) {
      if (!shown) continue;
      sphere.copy(mesh.geometry.boundingSphere).applyMatrix4(mesh.matrixWorld);
      if (ray.ray.distanceToPoint(sphere.center) > sphere.radius + 0.1) continue;
      const positions = mesh.geometry.attributes.position, n = shown;
      for (let i = 0; i < n; ++i) {
        p.set(positions.getX(i), positions.getY(i), positions.getZ(i)).divideScalar(65535).applyMatrix4(mesh.matrixWorld);
        if (p.y > cloudMaterial.uniforms.cut.value) continue;
        const distance = p.clone().sub(ray.ray.origin).dot(ray.ray.direction);
        const limit = view === 'top' ? 5 / topCamera.zoom * (topCamera.top - topCamera.bottom) / innerHeight : 5 * pixel * distance;
        if (distance > 0 && distance < best.distance && ray.ray.distanceToPoint(p) < limit) { best.distance = distance; best.point = p.clone(); }
      }
    }
    return best.point;
  }
  function pickFloor(x, y) {
    ray.setFromCamera(new THREE.Vector2(2 * x / innerWidth - 1, 1 - 2 * y / innerHeight), camera());
    return ray.ray.intersectPlane(new THREE.Plane(new THREE.Vector3(0, 1, 0), 0), new THREE.Vector3());
  }
  function setTool(name) {
    tool = tool === name ? null : name;
    picked = [];
    layers.measure.remove(...layers.measure.children);
    $('measure').classList.toggle('on', tool === 'measure');
    $('zone').classList.toggle('on', tool === 'zone');
    notice(tool === 'measure' ? 'Click two points.' : tool === 'zone' ? 'Click the corners on the floor, then Enter or Save.' : '');
    dirty = true;
  }
  function notice(text) {
    $('measured-text').textContent = text;
    $('measured').hidden = !text;
    $('save').hidden = tool !== 'zone' || picked.length < 3;
  }
  function pick(x, y) {
    const point = tool === 'zone' ? pickFloor(x, y) : pickPoint(x, y);
    if (!point) { notice('There is no point here.'); return; }
    if (tool === 'measure' && picked.length === 2) { picked = []; layers.measure.remove(...layers.measure.children); }
    picked.push(point);
    const dot = new THREE.Points(new THREE.BufferGeometry().setFromPoints([point]), new THREE.PointsMaterial({ size: 9, sizeAttenuation: false, color: color('relocalized'), depthTest: false }));
    layers.measure.add(dot);
    if (picked.length > 1) layers.measure.add(linesOf(new Float32Array(picked.slice(-2).flatMap((p) => p.toArray())), { shade: color('relocalized'), width: 2.5, onTop: true }));
    const at = world.worldToLocal(point.clone());
    state.picked = [at.x, at.y, at.z];
    const place = `world frame: [${state.picked.map((x) => x.toFixed(2)).join(', ')}] m`;
    notice(tool === 'zone' ? `corner ${picked.length}, ${place}` : place);
    if (tool === 'measure' && picked.length === 2) {
      const [a, b] = picked;
      state.measured = a.distanceTo(b);
      notice(`${state.measured.toFixed(3)} m  (level ${Math.hypot(a.x - b.x, a.z - b.z).toFixed(3)} m, height ${Math.abs(a.y - b.y).toFixed(3)} m); ${place}`);
    }
    dirty = true;
  }
  // Returns the drawn zones in the format of --zones.
  function zoneYaml() {
    const row = (corner) => '[' + corner.map((x) => x.toFixed(3)).join(', ') + ']';
    return '# Zones of Stillmap, in the world frame of the trajectory [m]; docs/view.md explains them.\n'
      + (state.upFrom === 'images' ? '# up is a guess: the mean upward direction of the images. Check it.\n' : '')
      + `up: [${ground.up.join(', ')}]\nzones:\n`
      + drawn.map((zone) => `  - name: ${zone.name}\n    polygon: [${zone.polygon.map(row).join(', ')}]\n    height: [${zone.height.join(', ')}]\n`).join('');
  }
  function saveZone() {
    if (tool !== 'zone' || picked.length < 3) return;
    let number = 1;
    while (zones.some((zone) => zone.name === 'zone ' + number)) number += 1;
    const zone = { name: 'zone ' + number, polygon: picked.map((p) => world.worldToLocal(p.clone()).toArray()), height: [0, 2.5], up: ground.up };
    drawn.push(zone);
    zones = zones.concat([zone]);
    const link = document.createElement('a');
    link.href = URL.createObjectURL(new Blob([state.zoneYaml = zoneYaml()], { type: 'text/yaml' }));
    link.download = 'zones.yaml';
    link.click();
    setTool('zone');
    drawZones(zones);
    notice(`${zone.name} is saved as zones.yaml among this browser's downloads${drawn.length > 1 ? `, with the other ${drawn.length - 1} drawn` : ''}. It takes effect with --zones zones.yaml.`);
    state.notice = $('measured-text').textContent;
  }

  // ---------------------------------------------------------------------------------------------- messages
  // Offers the layers for which there are data.
  function offerLayers() {
    const offered = { cloud: state.points, path: path.n, keyframes: state.keyframes, loops: state.loops, movers: (tracks || []).length || trails.size,
      objects: state.objects, zones: zones.length, points: points.length, grid: !planner, floor: planner, obstacles: planner, free: planner };
    for (const box of document.querySelectorAll('[data-layer]')) {
      const name = box.dataset.layer, label = box.parentElement, keys = label.nextElementSibling;
      label.hidden = !offered[name];
      layers[name].visible = box.checked && !label.hidden;
      if (keys && keys.className === 'keys') keys.hidden = label.hidden;
    }
  }
  function readText(message) {
    switch (message.type) {
      case 'run':
        run = message;
        heard = performance.now();
        state.live = message.live;
        state.kind = message.kind;
        if (message.camera) intrinsics = message.camera;
        $('figure').style.aspectRatio = `${intrinsics.width} / ${intrinsics.height}`;
        $('figure').hidden = !message.live;
        $('no-image').textContent = '';
        $('frame').hidden = document.querySelector('[data-panel=frame]').hidden = /map|cloud/.test(message.kind);
        $('frame-title').textContent = message.live ? 'Frame' : 'Run';
        document.querySelector('[data-panel=frame]').textContent = message.live ? 'Frame' : 'Run';
        for (const keys of document.querySelectorAll('.image-keys')) keys.hidden = !message.live;
        document.title = message.name + ' – Stillmap';
        $('name').textContent = message.name;
        $('state').textContent = { live: 'waiting for the first frame', run: 'finished run', map: 'saved map', cloud: 'cloud' }[message.kind];
        $('state').className = 'pill';
        makeEye();
        break;
      case 'frame': readFrame(message); break;
      case 'map': drawMap(message); break;
      case 'movers': readMovers(message); break;
      case 'tracks': readTracks(message); break;
      case 'objects': drawObjects(message.objects); break;
      case 'palette': setPalette(message.colors, message.names); break;
      case 'summary': showSummary(message.summary); break;
      case 'cloud': showStaged(); mapCost = `; map: ${(message.bytes / 1024).toFixed(0)} KiB, ${Math.round(message.ms)} ms`; state.mapBytes = message.bytes; state.mapMs = message.ms; break;
      case 'zones': zones = message.zones.concat(drawn); drawZones(zones); break;
      case 'points': drawPoints(message.points); break;
      case 'warnings': showWarnings(message); break;
      case 'events': readEvents(message); break;
      case 'images': readImages(message); break;
      case 'planner': drawPlanner(message); break;
      case 'finished':
        state.live = false;
        state.finished = true;
        setNoImage('No images after the end: stillmap view shows them.');
        $('state').textContent = 'finished';
        $('state').className = 'pill';
        setTimeline(path.n ? path.t[path.n - 1] : 0);
        break;
    }
  }
  function readBinary(buffer) {
    const type = new Uint8Array(buffer, 0, 1)[0];
    if (type === 1) readChunk(buffer);
    else if (type === 2) readImage(buffer);
    else if (type === 3) readPath(buffer);
  }
  function clear() {
    for (const { mesh } of chunks.values()) { layers.cloud.remove(mesh); mesh.geometry.dispose(); }
    chunks.clear();
    sampleChunks();
    staged.clear();
    trails.clear();
    path.n = 0;
    tracks = null;
    mapMessage = null;
    ground.known = false;
    zones = drawn.slice();
    noImages = null;
    summary = {};
    highPeriods = [];
    movers.clear();
    drawMovers(() => []);
    drawPlanner(null);
    showFindings([]);
    drawObjects([]);
    drawZones(zones);
    drawPoints([]);
    drawPath();
    readEvents({ events: [] });
    showWarnings({ active: [], count: 0 });
    setPalette([], []);
    $('timeline').hidden = true;
    state.points = state.chunks = state.images = state.frames = 0;
    state.finished = false;
  }
  let wait = 400;
  // A WebSocket does not tell why it was refused.
  async function askWhy() {
    try {
      const answer = await fetch('/access' + location.search);
      state.refused = answer.status === 403 ? (await answer.text()).trim() : '';
    } catch (e) { /* the program does not answer at all */ }
    if (state.refused && !state.connected) $('state').textContent = 'no access';
    drawBanners();
  }
  function connect() {
    const socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/data${location.search}`);
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => {
      clear();
      state.connected = true;
      state.refused = '';
      fastest = Infinity;
      late = 0;
      heard = performance.now();
      state.connections += 1;
      wait = 400;
      $('state').textContent = 'connected';
      $('state').className = 'pill';
    };
    socket.onmessage = ({ data }) => {
      state.messages += 1;
      state.bytes += typeof data === 'string' ? data.length : data.byteLength;
      if (typeof data === 'string') readText(JSON.parse(data)); else readBinary(data);
    };
    socket.onclose = () => {
      if (state.connected || !closed) closed = performance.now();
      state.connected = false;
      if (!state.finished) { $('state').textContent = state.refused ? 'no access' : 'connection lost'; $('state').className = 'pill lost'; }
      askWhy();
      setTimeout(connect, wait);
      wait = Math.min(5000, 1.6 * wait);
    };
  }

  // ---------------------------------------------------------------------------------------------- controls
  function setView(name) {
    const before = view;
    view = state.view = name;
    if (name === 'orbit' && before === 'follow') { touched = false; fit(); }
    orbit.enabled = name === 'orbit';
    above.enabled = name === 'top';
    for (const button of document.querySelectorAll('[data-view]')) button.classList.toggle('on', button.dataset.view === name);
    if (name === 'top' && Number($('cut').value) >= 1 && ground.ceiling > 2.2) { $('cut').value = 1.9 / ground.ceiling; setCut(); }
    if (name !== 'top' && cloudMaterial.uniforms.cut.value < 1e9) { $('cut').value = 1; setCut(); }
    if (name === 'follow') { followed = performance.now(); orbitCamera.near = 0.05; orbitCamera.updateProjectionMatrix(); }
    dirty = true;
  }
  function setTheme(name) {
    document.documentElement.dataset.theme = name;
    renderer.setClearColor(color('back'));
    try { localStorage.setItem('theme', name); } catch (e) { /* private mode */ }
    layers.grid.side = 0;
    setHeights();
    drawPath();
    if (mapMessage) { const kept = touched; touched = true; drawMap(mapMessage); touched = kept; }
    drawZones(zones);
    drawPlanner(planner);
    colorPoints();
    dirty = true;
  }
  function turn(dx, dy) {
    const offset = orbitCamera.position.clone().sub(orbit.target), s = new THREE.Spherical().setFromVector3(offset);
    s.theta -= dx;
    s.phi = Math.min(3, Math.max(0.05, s.phi - dy));
    orbitCamera.position.copy(orbit.target).add(offset.setFromSpherical(s));
    orbit.update();
    touched = dirty = true;
  }
  function nearer(factor) {
    if (view === 'top') { topCamera.zoom *= factor; topCamera.updateProjectionMatrix(); } else { orbitCamera.position.sub(orbit.target).divideScalar(factor).add(orbit.target); orbit.update(); }
    touched = dirty = true;
  }
  const keys = {
    1: () => setView('orbit'), 2: () => setView('top'), 3: () => setView('follow'), f: () => { touched = false; fit(); }, m: () => setTool('measure'), z: () => setTool('zone'),
    l: () => $('theme').click(), s: () => $('sound').click(), '?': () => $('help').click(), p: () => document.body.classList.toggle('bare'),
    c: () => { $('colors').selectedIndex = ($('colors').selectedIndex + 1) % (state.classes ? 3 : 2); $('colors').dispatchEvent(new Event('change')); },
    n: () => stepEvent(1), b: () => stepEvent(-1),
    ' ': () => { if (!$('timeline').hidden) play(!playing); }, ',': () => step(-1), '.': () => step(1), Escape: () => tool && setTool(tool), Enter: saveZone,
    ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, 0.08), ArrowDown: () => turn(0, -0.08), '+': () => nearer(1.15), '-': () => nearer(1 / 1.15),
  };
  function step(frames) {
    if ($('timeline').hidden) return;
    play(false);
    showTime(path.t[Math.min(path.n - 1, Math.max(0, lower(path.t, path.n, now - 1e-4) + frames))]);
  }
  addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || /SELECT|DIALOG/.test(event.target.tagName) || $('keys').open) return;
    if (event.target.tagName === 'INPUT' && /Arrow/.test(event.key)) return;
    const action = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action || (event.target.tagName === 'BUTTON' && /^( |Enter)$/.test(event.key))) return;
    event.preventDefault();
    action();
  });
  let down = null;
  $('canvas').addEventListener('pointerdown', (event) => { down = [event.clientX, event.clientY]; });
  $('canvas').addEventListener('pointerup', (event) => {
    if (tool && down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) < 5) pick(event.clientX, event.clientY);
  });
  $('canvas').addEventListener('dblclick', (event) => {
    const point = tool ? null : pickPoint(event.clientX, event.clientY);
    if (point && view === 'orbit') { orbit.target.copy(point); orbit.update(); dirty = true; }
  });
  for (const button of document.querySelectorAll('[data-view]')) button.addEventListener('click', () => setView(button.dataset.view));
  for (const box of document.querySelectorAll('[data-layer]')) box.addEventListener('change', () => { offerLayers(); changed(); });
  for (const button of document.querySelectorAll('[data-panel]')) {
    button.addEventListener('click', () => {
      for (const panel of document.querySelectorAll('.panel')) panel.classList.toggle('open', panel.id === button.dataset.panel && !panel.classList.contains('open'));
    });
  }
  $('figure').addEventListener('click', () => { $('figure').classList.toggle('large'); drawBoxes(); });
  $('fit').addEventListener('click', () => keys.f());
  $('measure').addEventListener('click', () => setTool('measure'));
  $('zone').addEventListener('click', () => setTool('zone'));
  $('theme').addEventListener('click', () => setTheme(document.documentElement.dataset.theme === 'light' ? 'dark' : 'light'));
  $('save').addEventListener('click', saveZone);
  $('sound').addEventListener('click', () => { sound = !sound; soundAsked = true; drawBanners(); $('sound').classList.toggle('on', sound); if (sound) beep(); });
  $('help').addEventListener('click', () => { $('keys').showModal(); $('keys').scrollTop = 0; });
  $('colors').addEventListener('change', () => { cloudMaterial.uniforms.mode.value = Number($('colors').value); showClasses(); dirty = true; });
  $('size').addEventListener('input', changed);
  $('cut').addEventListener('input', setCut);
  $('marks').addEventListener('pointermove', showHint);
  $('marks').addEventListener('pointerleave', (event) => { if (event.pointerType === 'mouse') $('hint').hidden = true; });
  $('marks').addEventListener('pointerdown', (event) => { play(false); showTime(showHint(event)); });
  addEventListener('pointerdown', (event) => { if (event.target !== $('marks')) $('hint').hidden = true; });
  $('time').addEventListener('input', () => { play(false); showTime(Number($('time').value)); });
  $('play').addEventListener('click', () => play(!playing));

  // ---------------------------------------------------------------------------------------------- drawing
  function resize() {
    renderer.setSize(innerWidth, innerHeight, false);
    orbitCamera.aspect = innerWidth / innerHeight;
    const half = (topCamera.top - topCamera.bottom) / 2;
    topCamera.left = -half * orbitCamera.aspect;
    topCamera.right = half * orbitCamera.aspect;
    picture.value.set(innerWidth, innerHeight, picture.value.z);
    drawMarks();
    arrange();
  }
  addEventListener('resize', resize);
  function placePanels() {
    document.documentElement.style.setProperty('--top', $('top').offsetHeight + 'px');
    const below = $('timeline').getBoundingClientRect();
    document.documentElement.style.setProperty('--bottom', Math.max(56, below.height ? innerHeight - below.top : 0) + 'px');
    arrange();
  }
  const sizes = new ResizeObserver(() => requestAnimationFrame(placePanels));  // in the next frame, since it resizes the panels
  for (const id of ['top', 'layers', 'frame', 'timeline']) sizes.observe($(id));
  function showScale() {
    const perMeter = view === 'top' ? innerHeight * topCamera.zoom / (topCamera.top - topCamera.bottom)
      : innerHeight / (2 * Math.tan(orbitCamera.fov * Math.PI / 360) * Math.max(0.1, orbitCamera.position.distanceTo(orbit.target)));
    const wanted = 110 / perMeter, decade = 10 ** Math.floor(Math.log10(wanted)), length = [5, 2, 1].map((k) => k * decade).find((x) => x <= wanted);
    $('scale-bar').style.width = (length * perMeter) + 'px';
    $('scale-text').textContent = length >= 1 ? `${length} m` : `${Math.round(100 * length)} cm`;
  }
  let last = 0, second = 0, rendersBefore = 0, bytesBefore = 0, mapCost = '';
  let drawnAt = 0, changedAt = 0, restBudget = 0;
  // Fits points and pixels to the time of the last frame [ms].
  function adapt(spent) {
    if (spent > 1.15 * FRAME_MS) {
      const excess = Math.max(0.25, FRAME_MS / spent);
      if (state.sharpness > COARSEST) state.sharpness = Math.max(COARSEST, state.sharpness * Math.sqrt(excess));
      else state.budget = Math.max(MIN_BUDGET, Math.min(state.budget, state.drawn) * excess);
    } else if (spent < 0.8 * FRAME_MS) {
      if (state.share < 1 && (state.drawn < ENOUGH || state.sharpness === 1)) state.budget = Math.min(MAX_BUDGET, state.budget * 1.08);
      else state.sharpness = Math.min(1, state.sharpness * 1.05);
    }
  }
  function setSharpness(value) {
    const ratio = Math.min(devicePixelRatio, 2) * value;
    if (Math.abs(renderer.getPixelRatio() - ratio) > 0.02) renderer.setPixelRatio(ratio);
    picture.value.z = 1 / renderer.getPixelRatio();
  }
  function draw(time) {
    requestAnimationFrame(draw);
    if (staged.size && time - stagedSince > 500) showStaged();
    if (playing) {
      const next = now + Math.min(0.1, (time - last) / 1000) * Number($('rate').value);
      if (next >= path.t[path.n - 1]) play(false);
      showTime(next);
    }
    last = time;
    follow();
    if (time - second > 1000) {
      state.fps = 1000 * (state.renders - rendersBefore) / (time - second);
      $('traffic').textContent = state.connected ? `${((state.bytes - bytesBefore) / 1024 / ((time - second) / 1000)).toFixed(0)} KiB/s, ${short(state.drawn)} points drawn${mapCost}` : '';
      rendersBefore = state.renders;
      bytesBefore = state.bytes;
      second = time;
    }
    // While the picture changes, a frame has the points and pixels that take FRAME_MS. At rest it gets all pixels, and
    // twice the points with each frame, until all are drawn or a frame has taken long.
    const changes = dirty;
    if (!changes && (state.rests || time - changedAt < REST_MS)) { drawnAt = 0; return; }
    const spent = drawnAt ? time - drawnAt : 0;
    drawnAt = time;
    if (changes) {
      if (restBudget === 0 && spent) adapt(spent);
      changedAt = time;
      restBudget = 0;
      state.rests = false;
    } else {
      const complete = state.share >= 1 && (restBudget > 0 || state.sharpness === 1);
      state.rests = complete || 2 * spent > SLOWEST_MS || restBudget > MAX_BUDGET;
      if (state.rests) return;
      restBudget = restBudget > 0 ? 2 * restBudget : state.budget;
    }
    dirty = false;
    if (state.live && path.n !== state.path) drawPath();
    dirty = false;
    if (changes) offerLayers();
    setSharpness(changes ? state.sharpness : 1);
    scene.updateMatrixWorld();
    camera().updateMatrixWorld();
    distribute(changes ? state.budget : restBudget);
    renderer.render(scene, camera());
    placeLabels();
    showScale();
    projected.copy(eye.position).applyMatrix4(world.matrixWorld).project(camera());
    state.eyeInView = eye.visible && projected.z < 1 && Math.max(Math.abs(projected.x), Math.abs(projected.y)) < 1;
    state.renders += 1;
  }
  // Pixel at which the target of the view is drawn, for tests.
  state.middle = () => {
    camera().updateMatrixWorld();
    const p = (view === 'top' ? above : orbit).target.clone().project(camera());
    return [(p.x + 1) / 2 * innerWidth, (1 - p.y) / 2 * innerHeight];
  };
  // Share of the canvas that is not background, for tests.
  state.inked = () => {
    renderer.render(scene, camera());
    const gl = renderer.getContext(), { width, height } = gl.canvas, pixels = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    const back = color('back');
    let inked = 0;
    for (let i = 0; i < pixels.length; i += 4) if (Math.abs(pixels[i] - 255 * back.r) + Math.abs(pixels[i + 1] - 255 * back.g) + Math.abs(pixels[i + 2] - 255 * back.b) > 24) inked += 1;
    return inked / (width * height);
  };
  state.spin = (on) => { clearInterval(state.timer); if (on) state.timer = setInterval(() => turn(0.02, 0), 10); };
  let theme = 'dark';
  try { theme = localStorage.getItem('theme') || (matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark'); } catch (e) { /* private mode */ }
  resize();
  setTheme(new URLSearchParams(location.search).get('theme') || theme);
  setView('orbit');
  connect();
  requestAnimationFrame(draw);
})();

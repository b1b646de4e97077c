// Draws bodies as instances of their shapes: a shadow map, then the picture.

const COMMON = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2DShadow;
`;
const TURNED = `
vec3 turned(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
`;
const BODY_VERTEX = COMMON + TURNED + `
layout(location = 0) in vec3 point;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 place;
layout(location = 3) in vec4 turn;
layout(location = 4) in vec4 colour;
layout(location = 5) in vec4 paint;
layout(location = 6) in vec2 onPicture;
layout(location = 7) in vec4 surface;
uniform mat4 clip, shadow;
uniform int first;
uniform float bias;
out vec3 at, facing, tint;
out vec4 inShadow;
flat out vec3 own;
out vec2 place2;
flat out vec3 finish;
flat out int body;
void main() {
  own = paint.rgb;
  place2 = onPicture;
  finish = vec3(surface.xy, surface.z > 0.0 ? 1.0 : 0.0);
  at = place + turned(turn, point);
  facing = turned(turn, normal);
  tint = colour.rgb;
  inShadow = shadow * vec4(at + bias * normalize(facing), 1.0);
  body = first + gl_InstanceID;
  gl_Position = colour.a < 0.5 ? vec4(2.0, 2.0, 2.0, 1.0) : clip * vec4(at, 1.0);
}`;
const LIGHT = `
uniform sampler2DShadow shadowMap;
uniform float shadowTexel;
uniform vec3 sun, eye;
vec3 linear(vec3 c) { return c * (c * (c * 0.305306011 + 0.682171111) + 0.012522878); }
vec3 shown(vec3 c) {
  c = c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14);
  return pow(clamp(c, 0.0, 1.0), vec3(1.0 / 2.2));
}
float lit(vec4 place) {
  if (shadowTexel <= 0.0) return 1.0;
  vec3 p = place.xyz * 0.5 + 0.5;
  if (any(lessThan(p, vec3(0.0))) || any(greaterThan(p, vec3(1.0)))) return 1.0;
  float turn = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715)))) * 6.2831853;
  float sum = 0.0;
  for (int i = 0; i < 8; ++i) {
    float a = turn + float(i) * 2.3999632, r = sqrt((float(i) + 0.5) / 8.0) * 2.6;
    sum += texture(shadowMap, vec3(p.xy + shadowTexel * r * vec2(cos(a), sin(a)), p.z));
  }
  vec2 rim = smoothstep(vec2(0.0), vec2(0.08), min(p.xy, 1.0 - p.xy));
  return mix(1.0, sum / 8.0, rim.x * rim.y);
}
`;
const BODY_FRAGMENT = COMMON + LIGHT + `
in vec3 at, facing, tint;
in vec4 inShadow;
flat in vec3 own;  // square roots of linear light
in vec2 place2;
flat in vec3 finish;  // roughness, clear coat, whether it has its own colours
flat in int body;
uniform int picked;
uniform bool painted, textured;
uniform sampler2D picture;
out vec4 result;
vec3 skyTowards(float up) { return mix(vec3(0.30, 0.28, 0.27), vec3(0.60, 0.66, 0.74), 0.5 + 0.5 * up); }
// Microfacet highlight of the sun; at a roughness of 0.45 it is as wide as a power of 47.
float highlight(float roughness, float cosine) {
  float power = 2.0 / pow(max(roughness, 0.15), 4.0) - 2.0;
  return 0.1 * (power + 2.0) / 49.0 * pow(max(cosine, 0.0), power);
}
void main() {
  vec3 n = normalize(facing), v = normalize(eye - at);
  if (dot(n, v) < 0.0 && !gl_FrontFacing) n = -n;
  vec3 texel = texture(picture, place2).rgb;
  vec3 albedo = painted && finish.z > 0.5 ? (textured ? texel : own * own) : linear(tint);
  float direct = max(dot(n, sun), 0.0) * lit(inShadow);
  float middle = dot(n, normalize(sun + v));
  vec3 c = albedo * (skyTowards(n.y) + direct * vec3(1.55, 1.46, 1.32)) + direct * highlight(finish.x, middle);
  float coat = finish.y * (0.04 + 0.96 * pow(1.0 - clamp(dot(n, v), 0.0, 1.0), 5.0));
  c = mix(c, skyTowards(reflect(-v, n).y), coat) + finish.y * direct * highlight(0.0, middle);
  if (body == picked) {
    float rim = pow(1.0 - max(dot(n, v), 0.0), 1.5);
    c = mix(c, vec3(1.0, 0.72, 0.15), 0.28 + 0.72 * rim);
  }
  result = vec4(shown(c), 1.0);
}`;
const GROUND_FRAGMENT = COMMON + LIGHT + `
in vec3 at, facing, tint;
in vec4 inShadow;
flat in int body;
uniform vec4 fade;  // centre, radius
uniform vec3 horizon;
out vec4 result;
void main() {
  vec3 albedo = mix(linear(tint), vec3(0.62), 0.35);
  float shade = lit(inShadow);
  vec3 c = albedo * (vec3(0.60, 0.65, 0.72) + max(dot(normalize(facing), sun), 0.0) * shade * vec3(1.05, 0.99, 0.9));
  float off = length(at - fade.xyz) / fade.w;
  result = vec4(mix(shown(c), horizon, smoothstep(0.15, 1.0, off)), 1.0);
}`;
const DEPTH_FRAGMENT = COMMON + `
void main() {}`;
const PICK_FRAGMENT = COMMON + `
flat in int body;
out vec4 result;
void main() {
  int n = body + 1;
  result = vec4(n & 255, (n >> 8) & 255, (n >> 16) & 255, 255) / 255.0;
}`;
const BACKDROP_VERTEX = COMMON + `
out float height;
uniform vec2 tilt;
void main() {
  vec2 p = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  height = tilt.x + tilt.y * p.y;
  gl_Position = vec4(p, 0.9999, 1.0);
}`;
const BACKDROP_FRAGMENT = COMMON + `
in float height;
uniform vec3 horizon;
out vec4 result;
void main() { result = vec4(mix(horizon, vec3(0.60, 0.69, 0.78), smoothstep(0.0, 0.9, height)), 1.0); }`;
const SIGN_VERTEX = COMMON + `
layout(location = 0) in vec3 point;
uniform mat4 clip;
uniform float size;
void main() { gl_Position = clip * vec4(point, 1.0); gl_PointSize = size; }`;
const SIGN_FRAGMENT = COMMON + `
uniform vec4 ink;
uniform bool round;
out vec4 result;
void main() {
  if (round && length(gl_PointCoord - 0.5) > 0.5) discard;
  result = ink;
}`;

const HORIZON = [0.906, 0.914, 0.918];
const SUN = unit([0.42, 0.82, 0.38]);
const INSTANCE = 8;  // floats: position, rotation, colour as four bytes

class Renderer {
  constructor(canvas, trajectory) {
    const gl = canvas.getContext("webgl2", { antialias: true, powerPreference: "high-performance" });
    if (!gl) throw new Error("This browser has no WebGL 2, or it is switched off.");
    this.gl = gl;
    this.canvas = canvas;
    this.shadowSize = Math.min(2048, gl.getParameter(gl.MAX_TEXTURE_SIZE));
    this.programs = {
      body: this.program(BODY_VERTEX, BODY_FRAGMENT), ground: this.program(BODY_VERTEX, GROUND_FRAGMENT),
      depth: this.program(BODY_VERTEX, DEPTH_FRAGMENT), pick: this.program(BODY_VERTEX, PICK_FRAGMENT),
      backdrop: this.program(BACKDROP_VERTEX, BACKDROP_FRAGMENT), sign: this.program(SIGN_VERTEX, SIGN_FRAGMENT),
    };
    this.empty = gl.createVertexArray();
    this.makePictures(trajectory);
    this.makeBatches(trajectory);
    this.makeShadowMap();
    this.picked = -1;
    this.coarse = false;
    this.painted = true;
    this.shadows = true;
  }

  program(vertex, fragment) {
    const gl = this.gl, id = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(id, shader);
    }
    gl.linkProgram(id);
    if (!gl.getProgramParameter(id, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(id));
    const at = {};
    for (let i = gl.getProgramParameter(id, gl.ACTIVE_UNIFORMS); i-- > 0;) {
      const name = gl.getActiveUniform(id, i).name;
      at[name] = gl.getUniformLocation(id, name);
    }
    return { id, at };
  }

  // Number 0 stands for no picture.
  makePictures(trajectory) {
    const gl = this.gl, finer = gl.getExtension("EXT_texture_filter_anisotropic");
    this.pictures = [new ImageData(1, 1), ...trajectory.pictures].map((picture) => {
      const texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, gl.RGBA, gl.UNSIGNED_BYTE, picture);
      gl.generateMipmap(gl.TEXTURE_2D);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
      if (finer) gl.texParameterf(gl.TEXTURE_2D, finer.TEXTURE_MAX_ANISOTROPY_EXT, 4);
      return texture;
    });
    gl.bindTexture(gl.TEXTURE_2D, null);
  }

  // Bodies of one shape are contiguous: one draw call per shape and picture.
  makeBatches(trajectory) {
    const gl = this.gl, n = trajectory.count;
    this.floats = new Float32Array(INSTANCE * n);
    this.bytes = new Uint8Array(this.floats.buffer);
    this.instances = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    gl.bufferData(gl.ARRAY_BUFFER, this.floats.byteLength, gl.DYNAMIC_DRAW);
    this.surfaces = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.surfaces);
    gl.bufferData(gl.ARRAY_BUFFER, trajectory.surface, gl.STATIC_DRAW);
    this.batches = [];
    for (let first = 0; first < n;) {
      let last = first;
      while (last < n && trajectory.shape[last] === trajectory.shape[first]) ++last;
      const shape = trajectory.shape[first], mesh = trajectory.meshes[shape];
      this.batches.push({ first, count: last - first, isPlane: PLANES.has(shape),
        levels: mesh.levels.map((level) => this.mesh(mesh, level, first)) });
      first = last;
    }
  }

  mesh(mesh, { indices, runs }, first) {
    const gl = this.gl, array = gl.createVertexArray();
    const buffer = (target, data) => {
      gl.bindBuffer(target, gl.createBuffer());
      gl.bufferData(target, data, gl.STATIC_DRAW);
    };
    gl.bindVertexArray(array);
    buffer(gl.ARRAY_BUFFER, mesh.points);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    buffer(gl.ARRAY_BUFFER, mesh.normals);
    gl.vertexAttribPointer(1, 3, gl.BYTE, true, 4, 0);
    if (mesh.paint) {
      buffer(gl.ARRAY_BUFFER, mesh.paint);
      gl.vertexAttribPointer(5, 4, gl.UNSIGNED_BYTE, true, 4, 0);
      gl.enableVertexAttribArray(5);
    }
    if (mesh.places) {
      buffer(gl.ARRAY_BUFFER, mesh.places);
      gl.vertexAttribPointer(6, 2, gl.FLOAT, false, 8, 0);
      gl.enableVertexAttribArray(6);
    }
    buffer(gl.ELEMENT_ARRAY_BUFFER, indices);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    const stride = 4 * INSTANCE, at = first * stride;
    gl.vertexAttribPointer(2, 3, gl.FLOAT, false, stride, at);
    gl.vertexAttribPointer(3, 4, gl.FLOAT, false, stride, at + 12);
    gl.vertexAttribPointer(4, 4, gl.UNSIGNED_BYTE, true, stride, at + 28);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.surfaces);
    gl.vertexAttribPointer(7, 4, gl.UNSIGNED_BYTE, true, 4, 4 * first);
    for (const i of [0, 1, 2, 3, 4, 7]) {
      gl.enableVertexAttribArray(i);
      if (i > 1) gl.vertexAttribDivisor(i, 1);
    }
    gl.bindVertexArray(null);
    return { array, runs };
  }

  makeShadowMap() {
    const gl = this.gl;
    this.shadowMap = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.shadowMap);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, this.shadowSize, this.shadowSize);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
    this.shadowTarget = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadowTarget);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.shadowMap, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  upload() {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.floats);
  }

  resize(ratio) {
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
  }

  // view: {eye, target, fov}; scene: {centre, radius}
  matrices(view, scene) {
    const aspect = this.canvas.width / this.canvas.height;
    const far = norm(minus(view.eye, scene.centre)) + 60 * scene.radius;
    const near = Math.max(norm(minus(view.eye, view.target)) / 60, far / 30000);
    this.clip = product(perspective(view.fov, aspect, near, far), looking(view.eye, view.target));
    this.shadow = product(orthographic(1.25 * scene.radius), looking(add(scene.centre, times(SUN, 0.001 * scene.radius)), scene.centre));
    this.aspect = aspect;
  }

  use(program, view, scene, clip) {
    const gl = this.gl, at = program.at;
    gl.useProgram(program.id);
    gl.uniformMatrix4fv(at.clip, false, clip);
    gl.uniformMatrix4fv(at.shadow, false, this.shadow);
    gl.uniform1f(at.bias, 2.5 * 2.5 * scene.radius / this.shadowSize);
    gl.uniform1i(at.shadowMap, 0);
    gl.uniform1f(at.shadowTexel, this.shadows ? 1 / this.shadowSize : 0);
    gl.uniform3fv(at.sun, SUN);
    gl.uniform3fv(at.eye, view.eye);
    gl.uniform1i(at.picked, this.picked);
    gl.uniform1i(at.painted, this.painted ? 1 : 0);
    gl.uniform1i(at.picture, 1);
    gl.uniform3fv(at.horizon, HORIZON);
    gl.uniform4f(at.fade, ...scene.ground, scene.reach);
  }

  drawBatches(program, planes, level) {
    const gl = this.gl;
    for (const batch of this.batches) {
      if (batch.isPlane !== planes) continue;
      const mesh = batch.levels[Math.min(level, batch.levels.length - 1)];
      gl.uniform1i(program.at.first, batch.first);
      gl.bindVertexArray(mesh.array);
      let from = 0;
      for (const [picture, count] of mesh.runs) {
        gl.activeTexture(gl.TEXTURE1);
        gl.bindTexture(gl.TEXTURE_2D, this.pictures[picture]);
        gl.uniform1i(program.at.textured, picture > 0 ? 1 : 0);
        gl.drawElementsInstanced(gl.TRIANGLES, count, gl.UNSIGNED_INT, 4 * from, batch.count);
        from += count;
      }
    }
    gl.activeTexture(gl.TEXTURE0);
    gl.bindVertexArray(null);
  }

  draw(view, scene, signs) {
    const gl = this.gl, programs = this.programs;
    this.matrices(view, scene);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    if (this.shadows) {
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadowTarget);
      gl.viewport(0, 0, this.shadowSize, this.shadowSize);
      gl.clear(gl.DEPTH_BUFFER_BIT);
      this.use(programs.depth, view, scene, this.shadow);
      this.drawBatches(programs.depth, false, 1);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.shadowMap);
    gl.useProgram(programs.backdrop.id);
    gl.uniform3fv(programs.backdrop.at.horizon, HORIZON);
    gl.uniform2f(programs.backdrop.at.tilt, unit(minus(view.target, view.eye))[1], Math.tan(view.fov / 2));
    gl.depthMask(false);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.depthMask(true);
    this.use(programs.ground, view, scene, this.clip);
    this.drawBatches(programs.ground, true, 0);
    this.use(programs.body, view, scene, this.clip);
    this.drawBatches(programs.body, false, this.coarse ? 1 : 0);
    this.drawSigns(signs);
  }

  // Translucent: {kind: "triangles" | "lines" | "points", points: Float32Array, ink: [r, g, b, a]};
  // also `through` for signs drawn through bodies, and `moves` for points that move.
  drawSigns(signs) {
    if (signs.length === 0) return;
    const gl = this.gl, { id, at } = this.programs.sign;
    gl.useProgram(id);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    gl.bindVertexArray(this.empty);
    gl.uniformMatrix4fv(at.clip, false, this.clip);
    gl.uniform1f(at.size, 5 * this.canvas.width / this.canvas.clientWidth);
    for (const sign of signs) {
      const isNew = !sign.buffer;
      if (isNew) sign.buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, sign.buffer);
      if (isNew || sign.moves) gl.bufferData(gl.ARRAY_BUFFER, sign.points, sign.moves ? gl.DYNAMIC_DRAW : gl.STATIC_DRAW);
      gl.enableVertexAttribArray(0);
      gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
      gl.uniform4fv(at.ink, sign.ink);
      gl.uniform1i(at.round, sign.kind === "points" ? 1 : 0);
      if (sign.through) gl.disable(gl.DEPTH_TEST);
      gl.drawArrays({ triangles: gl.TRIANGLES, lines: gl.LINES, points: gl.POINTS }[sign.kind], 0, sign.points.length / 3);
      gl.enable(gl.DEPTH_TEST);
    }
    gl.disableVertexAttribArray(0);
    gl.bindVertexArray(null);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  // The body at a pixel of the canvas, counted from the top left corner; -1: none.
  bodyAt(x, y, view, scene) {
    const gl = this.gl, width = this.canvas.width, height = this.canvas.height;
    const target = gl.createFramebuffer(), colour = gl.createRenderbuffer(), depth = gl.createRenderbuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    for (const [buffer, format, place] of [[colour, gl.RGBA8, gl.COLOR_ATTACHMENT0], [depth, gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]]) {
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, buffer);
    }
    gl.viewport(0, 0, width, height);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(x, height - 1 - y, 1, 1);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.matrices(view, scene);
    this.use(this.programs.pick, view, scene, this.clip);
    this.drawBatches(this.programs.pick, true, 0);
    this.drawBatches(this.programs.pick, false, 0);
    const pixel = new Uint8Array(4);
    gl.readPixels(x, height - 1 - y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    gl.disable(gl.SCISSOR_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(target);
    gl.deleteRenderbuffer(colour);
    gl.deleteRenderbuffer(depth);
    return pixel[0] + 256 * pixel[1] + 65536 * pixel[2] - 1;
  }
}

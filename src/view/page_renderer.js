// Draws bodies as instances of their shapes: a shadow map, then the picture.

const COMMON = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2DShadow;
`;
const TURNED = `
vec3 turned(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
`;
const BODY_VERTEX = COMMON + SHADERS.surface + TURNED + `
layout(location = 0) in vec3 point;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 place;
layout(location = 3) in vec4 turn;
layout(location = 4) in vec4 colour;
layout(location = 5) in vec4 paint;
layout(location = 6) in vec2 onPicture;
layout(location = 7) in vec4 surface;
layout(location = 8) in vec2 ownPattern;
uniform mat4 clip, shadow;
uniform int first;
uniform float bias;
uniform bool painted;
uniform int clearOnes;  // 0: left out, 1: alone, 2: among the others
out vec3 at, facing, tint, onBody, ownFacing;
out vec4 inShadow;
flat out vec3 own;
out vec2 place2;
flat out float kind;  // surface.glsl, 1: as colours that mean something have it
flat out vec2 pattern;
flat out int body;
void main() {
  own = paint.rgb;
  place2 = onPicture;
  bool isGround = abs(255.0 * surface.w - 128.0) < 0.5;
  kind = painted || isGround ? surface.w : 1.0;
  pattern = painted || isGround ? ownPattern : vec2(0.0, 1.0);
  at = place + turned(turn, point);
  facing = turned(turn, normal);
  onBody = point;
  ownFacing = normal;
  tint = colour.rgb;
  inShadow = shadow * vec4(at + bias * normalize(facing), 1.0);
  body = first + gl_InstanceID;
  bool isClear = is_clear(is_painted(kind) ? without_paint(kind) : kind);
  bool isDrawn = colour.a > 0.5 && (clearOnes == 2 || isClear == (clearOnes == 1));
  gl_Position = isDrawn ? clip * vec4(at, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
}`;
const LIGHT = SHADERS.surface + SHADERS.background + SHADERS.lighting + SHADERS.tone + `
uniform sampler2DShadow shadowMap;
uniform float shadowTexel, exposure;
uniform vec3 eye;
vec3 linear(vec3 c) { return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), greaterThan(c, vec3(0.04045))); }
vec3 srgb(vec3 c) { return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, greaterThan(c, vec3(0.0031308))); }
vec4 shown(vec3 light) { return vec4(srgb(min(tone_mapped(exposure * light), vec3(1.0))), 1.0); }
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
const SURFACE = COMMON + LIGHT + SHADERS.pattern + `
in vec3 at, facing, tint, onBody, ownFacing;
in vec4 inShadow;
flat in vec3 own;  // square roots of linear light
in vec2 place2;
flat in float kind;
flat in vec2 pattern;
flat in int body;
uniform int picked;
uniform bool textured;
uniform sampler2D picture;
out vec4 result;
// As surface.glsl has it, with the colour of the surface here.
vec4 material() {
  vec3 texel = texture(picture, place2).rgb;
  vec3 width = sqrt(dFdx(onBody) * dFdx(onBody) + dFdy(onBody) * dFdy(onBody));
  bool hasPaint = is_painted(kind);
  vec3 albedo = hasPaint ? (textured ? texel : own * own) : linear(tint);
  if (pattern.x > 0.5) albedo *= pattern_factor(pattern.x, pattern.y, onBody, ownFacing, width);
  return vec4(sqrt(albedo), hasPaint ? without_paint(kind) : kind);
}
`;
const BODY_FRAGMENT = SURFACE + `
void main() {
  vec3 n = normalize(facing), v = normalize(eye - at);
  if (dot(n, v) < 0.0 && !gl_FrontFacing) n = -n;
  vec3 light = radiance(n, material(), -v, length(eye - at), lit(inShadow), 1.0);
  if (body == picked) {
    float rim = pow(1.0 - max(dot(n, v), 0.0), 1.5);
    light = mix(light, vec3(1.0, 0.72, 0.15), 0.28 + 0.72 * rim);
  }
  result = shown(light);
}`;
// Light that a clear body lets through multiplies what is behind it, then light that it mirrors is
// added: neither depends on the order of bodies.
const CLEAR_FRAGMENT = SURFACE + `
uniform float chord;   // mean way through the body, in widths of it; 0: a sheet
uniform bool mirrors;
void main() {
  if (chord > 0.0 && !gl_FrontFacing) discard;
  vec3 n = normalize(facing), v = normalize(eye - at);
  if (!gl_FrontFacing) n = -n;
  vec4 of = material();
  float cosine = clamp(dot(n, v), 0.001, 1.0);
  float edge = 1.0 - cosine;
  float mirrored = 0.077 + 0.923 * edge * edge * edge * edge * edge;
  if (mirrors) {
    Gloss gloss = gloss_of(of.a);
    float highlight = 0.04 * 50.0 * pow(max(dot(n, normalize(v + to_light)), 0.0), 400.0);
    vec3 light = mirrored * mirrored_light(reflect(-v, n), gloss) + highlight * key_radiance;
    result = body == picked ? vec4(1.0, 0.72, 0.15, 1.0) * mix(0.28, 1.0, edge) : shown(light);
  } else {
    float within = sqrt(1.0 - (1.0 - cosine * cosine) / 2.25);
    vec3 albedo = max(of.rgb * of.rgb, vec3(0.001));
    vec3 light = (1.0 - mirrored) * (chord > 0.0 ? pow(albedo, vec3(1.5 * chord * within)) : albedo);
    result = vec4(srgb(light), 1.0);
  }
}`;
const GROUND_FRAGMENT = SURFACE + `
void main() {
  vec3 ray = at - eye;
  float away = length(ray);
  result = shown(radiance(normalize(facing), material(), ray / away, away, lit(inShadow), 1.0));
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
out vec3 ray;
uniform vec3 ahead, right, up;
void main() {
  vec2 p = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  ray = ahead + p.x * right + p.y * up;
  gl_Position = vec4(p, 0.9999, 1.0);
}`;
const BACKDROP_FRAGMENT = COMMON + LIGHT + `
in vec3 ray;
out vec4 result;
void main() { result = shown(backdrop * background(normalize(ray))); }`;
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
      clear: this.program(BODY_VERTEX, CLEAR_FRAGMENT), depth: this.program(BODY_VERTEX, DEPTH_FRAGMENT), pick: this.program(BODY_VERTEX, PICK_FRAGMENT),
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
    this.patterns = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.patterns);
    gl.bufferData(gl.ARRAY_BUFFER, trajectory.pattern, gl.STATIC_DRAW);
    this.hasClear = false;
    for (let body = 0; body < n; ++body) {
      const special = trajectory.surface[4 * body + 3] % 64 - 1;
      if (trajectory.surface[4 * body + 3] < 128 && special >= 10 && special < 20) this.hasClear = true;
    }
    this.batches = [];
    for (let first = 0; first < n;) {
      let last = first;
      while (last < n && trajectory.shape[last] === trajectory.shape[first]) ++last;
      const shape = trajectory.shape[first], mesh = trajectory.meshes[shape];
      this.batches.push({ first, count: last - first, isPlane: PLANES.has(shape), chord: ABOUT.meshes[shape].chord,
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
    gl.bindBuffer(gl.ARRAY_BUFFER, this.patterns);
    gl.vertexAttribPointer(8, 2, gl.FLOAT, false, 8, 8 * first);
    for (const i of [0, 1, 2, 3, 4, 7, 8]) {
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
    this.shadow = product(orthographic(1.25 * scene.radius), looking(add(scene.centre, times(ABOUT.light.to_sun, 0.001 * scene.radius)), scene.centre));
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
    this.useLight(at);
    gl.uniform1f(at.fade_distance, 0.4 * scene.reach);
    gl.uniform1i(at.clearOnes, 0);
    gl.uniform3fv(at.eye, view.eye);
    gl.uniform1i(at.picked, this.picked);
    gl.uniform1i(at.painted, this.painted ? 1 : 0);
    gl.uniform1i(at.picture, 1);
  }

  useLight(at) {
    const gl = this.gl, light = ABOUT.light;
    for (const [name, key] of [["to_light", "to_sun"], ["key_radiance", "sun"], ["sky_radiance", "sky"],
      ["bounce_radiance", "bounce"], ["horizon", "horizon"], ["zenith", "zenith"]]) gl.uniform3fv(at[name], light[key]);
    gl.uniform1f(at.backdrop, light.backdrop);
    gl.uniform1f(at.exposure, light.exposure);
  }

  drawBatches(program, planes, level) {
    const gl = this.gl;
    for (const batch of this.batches) {
      if (batch.isPlane !== planes) continue;
      const mesh = batch.levels[Math.min(level, batch.levels.length - 1)];
      gl.uniform1i(program.at.first, batch.first);
      gl.uniform1f(program.at.chord, batch.chord);
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
    this.useLight(programs.backdrop.at);
    const high = Math.tan(view.fov / 2), axes = looking(view.eye, view.target), axis = (i, s) => [s * axes[i], s * axes[4 + i], s * axes[8 + i]];
    gl.uniform3fv(programs.backdrop.at.ahead, axis(2, -1));
    gl.uniform3fv(programs.backdrop.at.right, axis(0, high * this.aspect));
    gl.uniform3fv(programs.backdrop.at.up, axis(1, high));
    gl.depthMask(false);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.depthMask(true);
    this.use(programs.ground, view, scene, this.clip);
    this.drawBatches(programs.ground, true, 0);
    this.use(programs.body, view, scene, this.clip);
    this.drawBatches(programs.body, false, this.coarse ? 1 : 0);
    if (this.hasClear && this.painted) this.drawClear(view, scene);
    this.drawSigns(signs);
  }

  drawClear(view, scene) {
    const gl = this.gl, program = this.programs.clear;
    this.use(program, view, scene, this.clip);
    gl.uniform1i(program.at.clearOnes, 1);
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    for (const mirrors of [false, true]) {
      gl.uniform1i(program.at.mirrors, mirrors ? 1 : 0);
      gl.blendFunc(mirrors ? gl.ONE : gl.ZERO, mirrors ? gl.ONE : gl.SRC_COLOR);
      this.drawBatches(program, false, this.coarse ? 1 : 0);
    }
    gl.depthMask(true);
    gl.disable(gl.BLEND);
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
    gl.uniform1i(this.programs.pick.at.clearOnes, 2);
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

// b3768a80fffde15dce77b9512e2029f828c5465786136de46cafe46ccbbef84a
(()=>{function J(a){let e=a.getContext("webgl2",{alpha:!1,antialias:!1,depth:!1,preserveDrawingBuffer:!0});if(!e)throw new Error("it has no WebGL 2");return e}var fe=`#version 300 es
in vec2 corner;
out vec2 where;
void main() {
    gl_Position = vec4(corner, 0.0, 1.0);
    where = vec2(0.5, -0.5) * corner + 0.5;
}
`,Q=`
vec3 srgb(vec3 light) {
    return mix(12.92 * light, 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, light));
}
`;function ee(a,e,t=fe){let i=a.createProgram();for(let[r,n]of[[a.VERTEX_SHADER,t],[a.FRAGMENT_SHADER,e]]){let s=a.createShader(r);if(a.shaderSource(s,n),a.compileShader(s),!a.getShaderParameter(s,a.COMPILE_STATUS))throw new Error(a.getShaderInfoLog(s));a.attachShader(i,s)}if(a.bindAttribLocation(i,0,"corner"),a.linkProgram(i),!a.getProgramParameter(i,a.LINK_STATUS))throw new Error(a.getProgramInfoLog(i));return i}function te(a,[e,t,i,r]=[-1,-1,1,1]){let n=a.createBuffer();return a.bindBuffer(a.ARRAY_BUFFER,n),a.bufferData(a.ARRAY_BUFFER,new Float32Array([e,t,i,t,e,r,i,r]),a.STATIC_DRAW),a.enableVertexAttribArray(0),a.vertexAttribPointer(0,2,a.FLOAT,!1,0,0),n}function Y(a,e,t=a.NEAREST){for(let i of[a.TEXTURE_MIN_FILTER,a.TEXTURE_MAG_FILTER])a.texParameteri(e,i,t);for(let i of[a.TEXTURE_WRAP_S,a.TEXTURE_WRAP_T])a.texParameteri(e,i,a.CLAMP_TO_EDGE)}function V(a,e,t,i){let r=a.createTexture(),n=a.createFramebuffer();return a.bindTexture(a.TEXTURE_2D,r),Y(a,a.TEXTURE_2D),a.texStorage2D(a.TEXTURE_2D,1,e,t,i),a.bindFramebuffer(a.FRAMEBUFFER,n),a.framebufferTexture2D(a.FRAMEBUFFER,a.COLOR_ATTACHMENT0,a.TEXTURE_2D,r,0),{texture:r,frame:n,width:t,height:i}}var ae=(a,e)=>a*e/(e-a),_=(a,e,t,i)=>ae(a,t)*a/e/2*Math.abs(1/t-1/i);function N(a,e,t,i){let r=ae(a,t),n=2*e,[s,o]=[1,-1].map(c=>{let h=r-a-c*i*n;return h>1e-12?a*r/h:1/0});return{near:o,far:s}}function re(a){let[e,t,i]=PLAY.radii,r=Math.min(Math.max((a-e)/(t-e),0),1)*(i-1),n=Math.min(Math.floor(r),i-2),s=r-n;return Math.exp((1-s)*Math.log(PLAY.detail[n])+s*Math.log(PLAY.detail[n+1]))}var me=(a,e,t)=>re(a[1]/2*e/t)/re(a[0]/2*e/t);function se({apertures:a,reach:e},t){let r=[];for(let o=0;o<=400;o++)r.push(Math.min(Math.log(me(a,e*o/400,t)),o?r[o-1]:0));let n=Math.min(r[400],-1e-6),s=new Float32Array(128);for(let o=0,c=0;o<128;o++){let h=n*o/127;for(;c<400&&r[c]>h;)c++;let l=r[Math.max(c-1,0)],u=c&&l>r[c]?(l-h)/(l-r[c]):1;s[o]=e*Math.max(c-1+u,0)/400}return{table:s,lowest:n}}var ie=a=>-a/(1-.012*a);function z({sphere:a,cylinder:e,axis:t,accommodation:i}){let r=ie(t===180?a:a+e),n=ie(t===180?a+e:a);return[r,n].map(s=>["L+M","S"].map(o=>s+i-PLAY.chromatic[o]))}var R=(a,e)=>a*Math.sin(2*Math.PI*PLAY.oscillation.frequency*e);var j={head:e=>`#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
${e?"#define PACKED":""}
out vec4 made;
uniform ivec2 size;  // of what is drawn into, in its pixels

// Two numbers a pixel: floats, or 16 bits each, from 0 to 2, where a graphics card draws into no floats.
vec2 get(sampler2D from, ivec2 at) {
  vec4 stored = texelFetch(from, at, 0);
#ifdef PACKED
  return (floor(stored.xz * 255.0 + 0.5) * 256.0 + floor(stored.yw * 255.0 + 0.5)) / 32767.5;
#else
  return stored.xy;
#endif
}

vec4 put(vec2 value) {
#ifdef PACKED
  vec2 whole = clamp(floor(value * 32767.5 + 0.5), 0.0, 65535.0), high = floor(whole / 256.0), low = whole - high * 256.0;
  return vec4(high.x, low.x, high.y, low.y) / 255.0;
#else
  return vec4(value, 0.0, 1.0);
#endif
}

vec2 linear(vec2 coded) {
  return mix(coded / 12.92, pow((coded + 0.055) / 1.055, vec2(2.4)), step(0.04045, coded));
}

ivec2 mirrored(ivec2 at, ivec2 count) {
  at = (at + 2 * count) % (2 * count);
  return min(at, 2 * count - 1 - at);
}
`,blur:`
uniform sampler2D scene, from;
uniform bool first, pair;      // whether the scene itself is blurred; whether it holds two photographs
uniform ivec2 along;
uniform int reach;
uniform vec2 focus, gain;      // dioptres, and pixels of sigma per dioptre, of either view
uniform float most;            // dioptres at a green of 1
uniform float noise, levels;   // standard deviation of a pixel's noise; 2^bits - 1, or 0 for no steps
uniform uint seed;

vec2 light(ivec2 at) {
  if (!first) return get(from, at);
  vec2 coded = texelFetch(scene, at, 0).rg;
  return linear(pair ? coded : coded.rr);
}

uint pcg(uint v) {
  uint s = v * 747796405u + 2891336453u, w = ((s >> ((s >> 28u) + 4u)) ^ s) * 277803737u;
  return (w >> 22u) ^ w;
}

float normal(uint key) {
  uint a = pcg(key), b = pcg(a);
  return sqrt(3.0) * (float((a >> 16u) + (a & 65535u) + (b >> 16u) + (b & 65535u)) / 65536.0 - 2.0);
}

void main() {
  ivec2 here = ivec2(gl_FragCoord.xy);
  float vergence = texelFetch(scene, here, 0).g * most;
  vec2 mine = gain * abs(focus - vergence), sum = vec2(0.0), weights = vec2(0.0);
  for (int i = -reach; i <= reach; i++) {
    ivec2 at = here + i * along;
    if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))) continue;
    float other = texelFetch(scene, at, 0).g * most;
    vec2 sigma = gain * abs(focus - other);
    if (other < vergence) sigma = min(sigma, mine);
    sigma = max(sigma, 0.1);
    vec2 fall = exp(-0.5 / (sigma * sigma)), total = mix(1.0 + 2.0 * fall, 2.5066283 * sigma, step(0.6, sigma));
    vec2 weight = exp(-0.5 * float(i * i) / (sigma * sigma)) / total;
    sum += weight * light(at);
    weights += weight;
  }
  vec2 value = sum / max(weights, 1e-9);
  if (noise > 0.0) {
    uint place = uint(here.x + size.x * here.y);
    value += noise * vec2(normal(place + pcg(2u * seed)), normal(place + pcg(2u * seed + 1u)));
    value = clamp(value, 0.0, 1.0);
  }
  if (levels > 0.0) value = floor(clamp(value, 0.0, 1.0) * levels + 0.5) / levels;
  made = put(value);
}`,squares:`
uniform sampler2D from;
uniform ivec2 frame;
uniform bool laplacian;
vec2 at(ivec2 place) { return get(from, clamp(place, ivec2(0), frame - 1)); }
void main() {
  ivec2 corner = 4 * ivec2(gl_FragCoord.xy);
  vec2 sum = vec2(0.0);
  for (int y = 0; y < 4; y++) for (int x = 0; x < 4; x++) {
    ivec2 p = corner + ivec2(x, y);
    vec2 middle = at(p);
    if (laplacian) middle = abs(4.0 * middle - at(p + ivec2(1, 0)) - at(p - ivec2(1, 0)) - at(p + ivec2(0, 1)) - at(p - ivec2(0, 1)));
    sum += middle;
  }
  made = put(sum / 16.0);
}`,gather:`
uniform sampler2D from;
uniform ivec2 along;
uniform float sd;
uniform bool squared;
void main() {
  ivec2 here = ivec2(gl_FragCoord.xy);
  vec2 sum = vec2(0.0);
  float weights = 0.0;
  int reach = int(ceil(3.5 * sd));
  for (int i = -reach; i <= reach; i++) {
    float weight = exp(-float(i * i) / (2.0 * sd * sd));
    vec2 value = get(from, mirrored(here + i * along, size));
    sum += weight * (squared ? value * value : value);
    weights += weight;
  }
  sum /= weights;
  made = put(squared ? sqrt(sum) : sum);
}`,ratio:`
uniform sampler2D detail, light;
uniform float floors, least, clear;  // energy of the noise; limits of what can be compared
void main() {
  ivec2 here = ivec2(gl_FragCoord.xy);
  vec2 bright = get(light, here), energy = get(detail, here);
  energy = energy * energy - floors;
  bool valid = min(bright.x, bright.y) > 0.0 && energy.x > clear * floors && energy.x > least * least * bright.x * bright.x;
  float ratio = sqrt(max(energy.y, 0.0) / max(energy.x, 1e-12)) * bright.x / max(bright.y, 1e-6);
  made = put(valid ? vec2(min(ratio / 8.0, 1.9), 1.0) : vec2(0.0));
}`,depth:`
uniform sampler2D from;
uniform float table[128];   // defocus in dioptres, by the logarithm of the ratio, from 0 to lowest
uniform float lowest, plane, side;
void main() {
  vec2 ratio = get(from, ivec2(gl_FragCoord.xy));
  float at = clamp(log(max(8.0 * ratio.x, 1e-6)) / lowest, 0.0, 1.0) * 127.0;
  int below = min(int(at), 126);
  float defocus = mix(table[below], table[below + 1], at - float(below));
  made = put(vec2(max(plane - side * defocus, 0.0) / 8.0, ratio.y));
}`,show:`
uniform sampler2D scene, views, detail, light, ratio, depth;
uniform int what;
uniform ivec2 origin, frame;
uniform float most, exposure;
${Q}
vec3 scale(float share) {  // from far, dark blue, to near, yellow
  share = clamp(share, 0.0, 1.0);
  return mix(mix(vec3(0.05, 0.10, 0.35), vec3(0.36, 0.45, 0.52), min(2.0 * share, 1.0)), vec3(0.98, 0.88, 0.30), max(2.0 * share - 1.0, 0.0));
}
vec3 grey(float value) { return srgb(vec3(clamp(value, 0.0, 1.0))); }
void main() {
  ivec2 here = ivec2(gl_FragCoord.xy) - origin;
  here = min(ivec2(vec2(here) * vec2(frame) / vec2(size)), frame - 1);
  here.y = frame.y - 1 - here.y;
  ivec2 square = min(here / 4, frame / 4 - 1);
  vec3 shown = vec3(0.0);
  if (what < 2) {
    vec2 value = get(views, here) * exposure;
    shown = grey(what == 0 ? value.x : value.y);
  } else if (what < 4) {
    vec2 value = get(detail, square) / max(get(light, square), 1e-3);
    shown = grey(2.0 * (what == 2 ? value.x : value.y));
  } else if (what == 6) {
    shown = scale(texelFetch(scene, here, 0).g);
  } else {
    vec2 value = get(ratio, square);
    if (what == 5) value = get(depth, square);
    if (value.y > 0.5) {
      if (what == 4) shown = vec3(min(8.0 * value.x, 1.0));
      else if (what == 5) shown = scale(8.0 * value.x / most);
      else {
        float side = clamp(log(max(8.0 * value.x, 1e-3)) / 1.5, -1.0, 1.0);
        shown = mix(vec3(0.92), side > 0.0 ? vec3(0.80, 0.33, 0.0) : vec3(0.0, 0.36, 0.65), abs(side));
      }
    }
  }
  made = vec4(shown, 1.0);
}`};var L=class{constructor(e,{packed:t=!1}={}){let i=J(e);Object.assign(this,{canvas:e,gl:i,packed:t||!i.getExtension("EXT_color_buffer_float"),programs:{},targets:{}});for(let r of["blur","squares","gather","ratio","depth","show"])this.programs[r]=this.step(j[r]);te(i),this.scene=i.createTexture()}step(e){let t=this.gl,i=ee(t,j.head(this.packed)+e),r={};for(let n=0;n<t.getProgramParameter(i,t.ACTIVE_UNIFORMS);n++){let{name:s,type:o}=t.getActiveUniform(i,n);r[s.replace("[0]","")]={place:t.getUniformLocation(i,s),type:o,list:s.endsWith("[0]")}}return{made:i,uniforms:r}}load(e,{width:t,height:i,vergence:r=1,pair:n=!1}){let s=this.gl;s.bindTexture(s.TEXTURE_2D,this.scene),Y(s,s.TEXTURE_2D),s.pixelStorei(s.UNPACK_COLORSPACE_CONVERSION_WEBGL,s.NONE),e instanceof Uint8Array?s.texImage2D(s.TEXTURE_2D,0,s.RGBA8,t,i,0,s.RGBA,s.UNSIGNED_BYTE,e):s.texImage2D(s.TEXTURE_2D,0,s.RGBA8,s.RGBA,s.UNSIGNED_BYTE,e),Object.assign(this,{width:t,height:i,vergence:r,pair:n});for(let{texture:h,frame:l}of Object.values(this.targets))s.deleteTexture(h),s.deleteFramebuffer(l);let o=[t>>2,i>>2],c=this.packed?s.RGBA8:s.RGBA32F;this.targets={};for(let h of["half","views"])this.targets[h]=V(s,c,t,i);for(let h of["detail","light","across","ratio","depth"])this.targets[h]=V(s,c,...o)}run(e,t,i){let r=this.gl,{made:n,uniforms:s}=this.programs[e],o=this.targets[t],[c,h,l,u]=o?[0,0,o.width,o.height]:t;r.bindFramebuffer(r.FRAMEBUFFER,o?o.frame:null),r.viewport(c,h,l,u),r.useProgram(n);let d=0;for(let[p,{place:g,type:w,list:x}]of Object.entries(s)){let b=p==="size"?[l,u]:i[p];if(w===r.SAMPLER_2D){let y=p==="scene"?this.scene:this.targets[b??p].texture;r.activeTexture(r.TEXTURE0+d),r.bindTexture(r.TEXTURE_2D,y),r.uniform1i(g,d++)}else x?r.uniform1fv(g,b):w===r.FLOAT?r.uniform1f(g,b):w===r.FLOAT_VEC2?r.uniform2f(g,...b):w===r.INT_VEC2?r.uniform2i(g,...b):w===r.UNSIGNED_INT?r.uniform1ui(g,b):r.uniform1i(g,Number(b))}r.drawArrays(r.TRIANGLE_STRIP,0,4)}draw({apertures:e=[0,0],focus:t=[0,0],tiles:i,columns:r=i.length,noise:n=0,bits:s=0,seed:o=0,window:c=0,read:h=null},l){let{width:u,height:d,vergence:p,pair:g}=this,w=[u>>2,d>>2],x=e.map(S=>PLAY.k*S/2/l),b=Array.isArray(t[0])?t:[t,t],y=Math.max(...b.flatMap(S=>S.map(($,D)=>x[D]*Math.max(Math.abs($),Math.abs($-p))))),k={gain:x,most:p,pair:g,reach:g?0:Math.min(24,Math.ceil(3*y))};this.run("blur","half",{...k,first:!0,along:[1,0],focus:b[0],from:"views",noise:0,levels:0,seed:o}),this.run("blur","views",{...k,first:!1,pair:!1,along:[0,1],focus:b[1],from:"half",noise:n,levels:s&&2**s-1,seed:o}),i.some(S=>S>1&&S!==6)&&this.compare({noise:n,bits:s,window:c,read:h,grid:w});let E=Math.ceil(i.length/r),{canvas:A}=this;(A.width!==r*u||A.height!==E*d)&&Object.assign(A,{width:r*u,height:E*d}),i.forEach((S,$)=>{let D=[$%r*u,(E-1-Math.floor($/r))*d];this.run("show",[...D,u,d],{what:S,origin:D,frame:[u,d],most:p,exposure:1})})}compare({noise:e,bits:t,window:i,read:r,grid:n}){let s=[this.width,this.height],o=h=>Math.sqrt(h*h-16/12)/4,c=20*(2/Math.PI)*(e*e+(t&&(2**t-1)**-2/12));for(let[h,l]of[["detail",!0],["light",!1]]){this.run("squares",h,{from:"views",frame:s,laplacian:l});let u=l?i:PLAY.brightness;u&&(this.run("gather","across",{from:h,along:[1,0],sd:o(u),squared:l}),this.run("gather",h,{from:"across",along:[0,1],sd:o(u),squared:l}))}this.run("ratio","ratio",{floors:c,least:PLAY.least,clear:PLAY.clear}),r&&this.run("depth","depth",{from:"ratio",...se(r,PLAY.scene.pixel_angle),plane:r.plane,side:r.side})}read(e){let t=this.gl,{frame:i,width:r,height:n}=this.targets[e],s=new Float32Array(2*r*n);t.bindFramebuffer(t.FRAMEBUFFER,i);let o=this.packed?new Uint8Array(4*r*n):new Float32Array(4*r*n);t.readPixels(0,0,r,n,t.RGBA,this.packed?t.UNSIGNED_BYTE:t.FLOAT,o);for(let h=0;h<r*n;h++)for(let l=0;l<2;l++)s[2*h+l]=this.packed?(256*o[4*h+2*l]+o[4*h+2*l+1])/32767.5:o[4*h+l];let c="";for(let h of new Uint8Array(s.buffer))c+=String.fromCharCode(h);return btoa(c)}};var B=navigator.language.startsWith("de")?"de":"en",ne=a=>{B=a},m=a=>{let e=W[a];if(!e)throw new Error(`no words for ${a}`);return e[B==="de"?1:0]},v=(a,e)=>{let t=a.toFixed(e).replace("-","\u2212");return B==="de"?t.replace(".",","):t},M=a=>`f/${v(a,Math.abs(a-Math.round(a))<.05?0:1)}`,W={title:["A New Sense for Depth of Field: the figures, live","Ein neuer Sinn f\xFCr Tiefe: die Abbildungen zum Ausprobieren"],intro:["A lens blurs each point according to its distance from the plane of focus, and this blur gives the distance back (A. P. Pentland, 1987). Everything here is computed in this page, at every change.","Eine Linse zeichnet jeden Punkt je nach Abstand von der Sch\xE4rfeebene unscharf, und aus dieser Unsch\xE4rfe folgt die Entfernung (A. P. Pentland, 1987). Alles hier wird in dieser Seite berechnet, bei jeder \xC4nderung."],footer:["The page stores nothing and sends nothing. Scene, tables and simulated observers: focalgradient (<code>docs/play/make.py</code>).","Die Seite speichert nichts und sendet nichts. Szene, Tabellen und simulierte Beobachter: focalgradient (<code>docs/play/make.py</code>)."],noWebgl:["This browser has no WebGL 2, which this panel needs.","Dieser Browser hat kein WebGL 2, das hier n\xF6tig ist."],unreadable:["\u201C{name}\u201D is not a picture that this browser reads: give a JPEG, PNG or WebP file.","\u201E{name}\u201C ist kein Bild, das dieser Browser liest: Geben Sie eine JPEG-, PNG- oder WebP-Datei an."],"lens.title":["Fig. 1: blur and distance","Abb. 1: Unsch\xE4rfe und Entfernung"],"lens.what":["A point has the same blur at two distances, one nearer and one farther than the plane of focus. Press a place in the picture to take its distance.<br>Eq. 1: <code>D = F v\u2080 / (v\u2080 \u2212 F \u2213 \u03C3 f)</code>, with f = F / (radius of the lens).","Ein Punkt ist in zwei Entfernungen gleich unscharf, vor und hinter der Sch\xE4rfeebene. Ein Druck auf das Bild \xFCbernimmt die Entfernung der Stelle.<br>Gl. 1: <code>D = F v\u2080 / (v\u2080 \u2212 F \u2213 \u03C3 f)</code>, mit f = F / (Radius der Linse)."],"lens.said":["Blur radius \u03C3 = {sigma} \xB5m on the sensor. Eq. 1 gives {near} (nearer) and {far} (farther).","Unsch\xE4rferadius \u03C3 = {sigma} \xB5m auf dem Sensor. Gl. 1 ergibt {near} (n\xE4her) und {far} (ferner)."],none:["no distance","keine Entfernung"],inFocus:["in focus","scharf"],sensor:["sensor","Sensor"],fNumber:["f-number of the second view","Blendenzahl des zweiten Bildes"],focusDistance:["focused at","Scharf eingestellt auf"],pointDistance:["distance of the point","Entfernung des Punktes"],"disparity.title":["Fig. 5: focal disparity","Abb. 5: Fokusdisparit\xE4t"],"disparity.what":["The wider aperture loses detail with distance from focus: the ratio of the Laplacians falls from 1 (white), and the table of the optics turns it into depth. Black: too little detail.<br>Eqs. 7\u20139: <code>ln F\u2081 \u2212 ln F\u2082 = 2\u03C0\xB2 \u03BB\xB2 (\u03C3\u2082\xB2 \u2212 \u03C3\u2081\xB2)</code>, in the real-time form of section III.","Die weitere Blende verliert mit dem Abstand von der Sch\xE4rfe an Einzelheiten: Das Verh\xE4ltnis der Laplace-Werte f\xE4llt von 1 (wei\xDF), und die Tabelle der Optik macht daraus Tiefe. Schwarz: zu wenig Einzelheiten.<br>Gl. 7\u20139: <code>ln F\u2081 \u2212 ln F\u2082 = 2\u03C0\xB2 \u03BB\xB2 (\u03C3\u2082\xB2 \u2212 \u03C3\u2081\xB2)</code>, in der Echtzeitform von Abschnitt III."],"disparity.said":["Depth map: yellow near, blue far. The two apertures do not show the side of focus: all is taken to lie on one side.","Tiefenkarte: gelb nah, blau fern. Zwei Blenden zeigen nicht, auf welcher Seite der Sch\xE4rfe etwas liegt: Alles gilt als auf einer Seite."],"disparity.control":["Control: both views through the small aperture. The scene is as deep as before, but the ratio is 1 everywhere, and there is no depth.","Kontrolle: beide Bilder durch die kleine Blende. Die Szene ist so tief wie zuvor, aber das Verh\xE4ltnis ist \xFCberall 1, und es gibt keine Tiefe."],"disparity.equal":["Both apertures are equal: the ratio is 1 everywhere and says nothing about depth.","Beide Blenden sind gleich: Das Verh\xE4ltnis ist \xFCberall 1 und sagt nichts \xFCber die Tiefe."],fSmall:["f-number of the first view","Blendenzahl des ersten Bildes"],fLarge:["f-number of the second view","Blendenzahl des zweiten Bildes"],focusVergence:["focus","Scharfstellung"],noise:["noise (of white)","Rauschen (von Wei\xDF)"],bits:["bits","Bits"],window:["window (SD)","Fenster (SD)"],control:["control: the small aperture twice","Kontrolle: zweimal die kleine Blende"],focalDisparity:["focal disparity","Fokusdisparit\xE4t"],depth:["depth","Tiefe"],trueDepth:["true depth","wahre Tiefe"],"eye.title":["The eye: two views at once, and two in time","Das Auge: zwei Bilder zugleich, und zwei nacheinander"],"eye.what":["Blue light is focused nearer than red and green, and the focus oscillates at 2 Hz: either gives two views. The colour of the ratio shows the side: orange where the second view is sharper, blue where the first is.<br>Eq. 11, in vergence: <code>\u03C3\u2081\xB2 \u2212 \u03C3\u2082\xB2</code> is linear in V, so that the side of focus is resolved.","Blaues Licht wird n\xE4her fokussiert als rotes und gr\xFCnes, und die Scharfstellung schwingt mit 2 Hz: Beides gibt zwei Bilder. Die Farbe des Verh\xE4ltnisses zeigt die Seite: orange, wo das zweite Bild sch\xE4rfer ist, blau, wo das erste.<br>Gl. 11, in Vergenzen: <code>\u03C3\u2081\xB2 \u2212 \u03C3\u2082\xB2</code> ist linear in V, sodass die Seite der Sch\xE4rfe feststeht."],"eye.said":["In focus: {first} at {a} D, {second} at {b} D. A grey scene in daylight; blur is geometric, without diffraction.","Scharf: {first} bei {a} D, {second} bei {b} D. Eine graue Szene bei Tageslicht; Unsch\xE4rfe geometrisch, ohne Beugung."],pupil:["pupil","Pupille"],accommodation:["accommodation","Akkommodation"],sphere:["prescription: sphere","Verordnung: Sph\xE4re"],cylinder:["cylinder","Zylinder"],axis:["axis","Achse"],"axis.180":["180\xB0","180\xB0"],"axis.90":["90\xB0","90\xB0"],pair:["pair of views","Bildpaar"],"pair.bands":["L+M and S cones","L+M- und S-Zapfen"],"pair.moments":["L+M cones, 250 ms apart","L+M-Zapfen, im Abstand von 250 ms"],amplitude:["oscillation (amplitude)","Schwingung (Amplitude)"],moving:["oscillate at 2 Hz","mit 2 Hz schwingen"],now:["L+M, now","L+M, jetzt"],before:["L+M, 250 ms ago","L+M, vor 250 ms"],ratio:["ratio, second / first","Verh\xE4ltnis, zweites / erstes"],"rating.title":["Fig. 3: your own impression of depth","Abb. 3: Ihr eigener Tiefeneindruck"],"rating.what":["Rate eight pictures for depth, then compare: blur behind a near object in focus may add depth, blur in front of a far one may not.<br>Blur grows with aperture as in Eq. 15: <code>r / v = \u03C3 / (v\u2080 \u2212 v)</code>. Answers stay in this page until you leave it.","Beurteilen Sie die Tiefe von acht Bildern und vergleichen Sie: Unsch\xE4rfe hinter einem nahen scharfen Gegenstand kann Tiefe hinzuf\xFCgen, Unsch\xE4rfe vor einem fernen nicht.<br>Unsch\xE4rfe w\xE4chst mit der Blende nach Gl. 15: <code>r / v = \u03C3 / (v\u2080 \u2212 v)</code>. Antworten bleiben in dieser Seite, bis Sie sie verlassen."],"rating.said":["Thick: you, one trial each. Dotted: {n} simulated observers with 95 % intervals, computed by a model; no data of people.","Dick: Sie, je ein Durchgang. Gepunktet: {n} simulierte Beobachter mit 95-%-Intervallen, von einem Modell berechnet; keine Daten von Menschen."],rating:["depth, relative to the standard (1 = equal)","Tiefe, verglichen mit dem Standard (1 = gleich)"],next:["Continue","Weiter"],again:["Rate again","Noch einmal"],"look.nearest":["Picture {n} of {all}. Look at the nearest object, marked at first.","Bild {n} von {all}. Blicken Sie auf den n\xE4chsten Gegenstand, der zuerst markiert ist."],"look.farthest":["Picture {n} of {all}. Look at the farthest object, marked at first.","Bild {n} von {all}. Blicken Sie auf den fernsten Gegenstand, der zuerst markiert ist."],standard:["standard: depth 1","Standard: Tiefe 1"],picture:["picture","Bild"],pinhole:["pinhole","Lochblende"],"key.nearest":["near object in focus (dotted: simulated)","naher Gegenstand scharf (gepunktet: simuliert)"],"key.farthest":["far object in focus (dotted: simulated)","ferner Gegenstand scharf (gepunktet: simuliert)"],"own.title":["Your own light","Ihr eigenes Licht"],"own.what":["Blur a picture of your own by its depth map, or compare two photographs from a tripod that differ in aperture or focus. Files stay in this browser.<br>Eq. 16 in vergence: <code>V = V_f \u2213 \u03C3 / (v\u2080 A/2)</code>; the ratio as in Fig. 5.","Zeichnen Sie ein eigenes Bild nach seiner Tiefenkarte unscharf, oder vergleichen Sie zwei Fotos vom Stativ mit verschiedener Blende oder Scharfstellung. Dateien bleiben in diesem Browser.<br>Gl. 16 in Vergenzen: <code>V = V_f \u2213 \u03C3 / (v\u2080 A/2)</code>; das Verh\xE4ltnis wie in Abb. 5."],mode:["what to use","Was verwendet wird"],"mode.depth":["picture and depth map","Bild und Tiefenkarte"],"mode.photographs":["two photographs","zwei Fotos"],depthMap:["depth map (grey is linear in 1/distance)","Tiefenkarte (Grau ist linear in 1/Entfernung)"],photograph1:["first photograph","erstes Foto"],photograph2:["second photograph","zweites Foto"],white:["white is","Wei\xDF ist"],"white.near":["near","nah"],"white.far":["far","fern"],near:["nearest distance (m)","kleinste Entfernung (m)"],far:["farthest distance (m)","gr\xF6\xDFte Entfernung (m)"],fieldDegrees:["width of the picture (degrees)","Breite des Bildes (Grad)"],aperture:["aperture","Blendendurchmesser"],ownFocus:["focused at","Scharf eingestellt auf"],f1:["f-number of the first","Blendenzahl des ersten"],f2:["f-number of the second","Blendenzahl des zweiten"],focus1:["focus of the first (m)","Sch\xE4rfe des ersten (m)"],focus2:["focus of the second (m)","Sch\xE4rfe des zweiten (m)"],blurred:["blurred","unscharf"],"own.example":["Until you choose files, this is the scene of the other panels.","Bis Sie Dateien w\xE4hlen, ist dies die Szene der anderen Tafeln."],"own.here":["Your picture, in grey, at no more than 640 pixels.","Ihr Bild, in Grau, mit h\xF6chstens 640 Bildpunkten."],"own.equal":["Aperture and focus are equal: the ratio says nothing about depth.","Blende und Scharfstellung sind gleich: Das Verh\xE4ltnis sagt nichts \xFCber die Tiefe."],"own.apertures":["Smaller aperture first. White: in focus; the darker the blue, the farther from focus, on either side.","Kleinere Blende zuerst. Wei\xDF: scharf; je dunkler das Blau, desto weiter von der Sch\xE4rfe, auf beiden Seiten."],"own.foci":["Nearer focus first. Blue: near; orange: far; white: in between, or too far from both.","N\xE4here Scharfstellung zuerst. Blau: nah; orange: fern; wei\xDF: dazwischen, oder weit von beiden."]};var P=matchMedia("(prefers-reduced-motion: reduce)"),oe=matchMedia("(max-width: 600px)");function f(a,e={},...t){let i=document.createElement(a),{word:r,...n}=e;return r&&(i.dataset.word=r),Object.assign(i,n),i.append(...t),i}async function F(a){let e=new Image;return e.src=a,await e.decode(),e}var T=class{constructor(e,{scene:t=!0}={}){this.id=e,this.state={},this.outputs=[],this.box=f("section",{id:e},f("h2",{word:`${e}.title`}),f("p",{className:"what",word:`${e}.what`})),this.box.tabIndex=-1,document.querySelector("main").append(this.box),document.querySelector("nav").append(f("a",{href:`#${e}`,word:`${e}.title`})),this.controls=f("div",{className:"controls"}),this.said=f("p",{className:"said"}),this.said.setAttribute("aria-live","polite"),t&&this.addViews(),this.box.append(this.controls,this.said)}addViews(){this.canvas=f("canvas"),this.canvas.setAttribute("role","img"),this.captions=f("ol");let e=f("div",{className:"tiles"},this.canvas,this.captions);this.box.append(e);try{this.views=new L(this.canvas)}catch(t){if(!t.message.includes("WebGL 2"))throw t;e.replaceChildren(f("p",{className:"lacking",word:"noWebgl"}))}this.visible=!0,new IntersectionObserver(t=>{this.visible=t[0].isIntersecting,this.change()}).observe(this.canvas),oe.addEventListener("change",()=>this.change()),this.start=performance.now()}async load(){this.views&&(this.views.load(await F(PLAY.scene.png),PLAY.scene),this.change())}range(e,{min:t,max:i,step:r,value:n,format:s=String,from:o=c=>c}){let c=f("input",{type:"range"}),h=f("span",{className:"value"});Object.assign(c,{min:t,max:i,step:r,value:n});let l=()=>{this.state[e]=o(Number(c.value)),h.textContent=s(this.state[e]),c.setAttribute("aria-valuetext",h.textContent)};return this.add(e,c,l,h)}check(e,t){let i=f("input",{type:"checkbox",checked:t});return this.add(e,i,()=>{this.state[e]=i.checked})}choice(e,t,i){let r=f("select",{},...t.map(n=>f("option",{value:n,word:`${e}.${n}`})));return r.value=i,this.add(e,r,()=>{this.state[e]=r.value})}number(e,t,i){let r=f("input",{type:"number",min:i,step:"any",value:t});return this.add(e,r,()=>{r.valueAsNumber>0&&(this.state[e]=r.valueAsNumber)})}add(e,t,i,r=""){t.name=e,t.addEventListener("input",()=>{i(),this.change()});let n=f("span",{word:e}),s=t.type==="checkbox",o=f("label",{className:s?"check":""},...s?[t,n]:[n,r,t]);return this.controls.append(o),this.outputs.push(i),i(),{input:t,label:o,set:c=>{t.value=c,i(),this.change()}}}translate(){for(let e of this.outputs)e();this.change()}change(){this.waiting||(this.waiting=requestAnimationFrame(()=>{this.waiting=0,this.drawn(),this.visible&&this.moves?.()&&!P.matches&&this.change()}))}seconds(){return P.matches?.125:(performance.now()-this.start)/1e3}drawn(){this.views?.width&&this.draw()}show(e,t,i,r=PLAY.scene.pixel_angle){let n=Math.min(e.length,oe.matches?e.length>2?2:1:e.length===4?2:3);this.views.draw({...i,tiles:e,columns:n},r);let s=t.join("|")+n;this.captioned!==s&&(this.captioned=s,this.captions.style.gridTemplate=`repeat(${Math.ceil(e.length/n)}, 1fr) / repeat(${n}, 1fr)`,this.captions.replaceChildren(...t.map(o=>f("li",{},f("span",{textContent:o})))),this.canvas.setAttribute("aria-label",t.join(", ")))}};var I=class extends T{constructor(){super("disparity");let e={min:0,max:10,step:1,from:t=>4*2**(t/2),format:M};this.range("fSmall",{...e,value:8}),this.range("fLarge",{...e,value:5}),this.range("focusVergence",{min:0,max:1.75,step:.05,value:1.75,format:t=>`${v(t,2)} D`}),this.range("noise",{min:0,max:3,step:.1,value:0,format:t=>`${v(t,1)} %`}),this.range("bits",{min:4,max:12,step:1,value:12,format:t=>String(t)}),this.range("window",{min:2,max:16,step:1,value:6,format:t=>`${t} px`}),this.check("control",!1),this.frame=0}moves(){return this.state.noise>0}given(){let{fSmall:e,fLarge:t,focusVergence:i,noise:r,bits:n,window:s,control:o}=this.state,c=PLAY.scene.focal_length,h=[c/Math.max(e,t),c/Math.min(e,t)],l=i,u=Math.max(l,PLAY.scene.vergence-l),d=l>PLAY.scene.vergence/2?1:-1;return{apertures:o?[h[0],h[0]]:h,focus:[l,l],noise:r/100,bits:n,window:s,seed:P.matches?1:++this.frame,read:{apertures:h,plane:l,side:d,reach:u}}}draw(){let e=this.given(),t=PLAY.scene.focal_length,i=e.apertures.map(n=>M(t/n)),r=[...i,...i.map(n=>`|\u2207\xB2|, ${n}`),m("focalDisparity"),m("depth")];this.show([0,1,2,3,4,5],r,e),this.said.textContent=m(this.state.control?"disparity.control":e.apertures[0]===e.apertures[1]?"disparity.equal":"disparity.said")}};var C=class extends T{constructor(){super("eye");let e=t=>`${t>0?"+":""}${v(t,2)} D`;this.range("pupil",{min:2,max:8,step:.5,value:6,format:t=>`${v(t,1)} mm`}),this.range("accommodation",{min:0,max:4,step:.05,value:.8,format:e}),this.range("sphere",{min:-4,max:2,step:.25,value:0,format:e}),this.range("cylinder",{min:-3,max:0,step:.25,value:0,format:e}),this.choice("axis",["180","90"],"180"),this.choice("pair",["bands","moments"],"bands"),this.range("amplitude",{min:0,max:.5,step:.05,value:PLAY.oscillation.amplitude,format:t=>`${v(t,2)} D`}),this.check("moving",!P.matches)}moves(){return this.state.moving&&this.state.amplitude>0}focus(){let{sphere:e,cylinder:t,axis:i,accommodation:r,amplitude:n,pair:s}=this.state,o=this.moves()?this.seconds():.125,c=z({sphere:e,cylinder:t,axis:Number(i),accommodation:r}),h=R(n,o),l=R(n,o-.5/PLAY.oscillation.frequency);return c.map(([u,d])=>s==="bands"?[u+h,d+h]:[u+h,u+l])}draw(){let e=this.focus(),t=this.state.pupil/1e3,i=this.state.pair==="bands"?["L+M","S"]:[m("now"),m("before")];this.show([0,1,7,6],[...i,m("ratio"),m("trueDepth")],{apertures:[t,t],focus:e,window:8});let r=n=>(e[0][n]+e[1][n])/2;this.said.textContent=m("eye.said").replace("{first}",i[0]).replace("{second}",i[1]).replace("{a}",v(r(0),2)).replace("{b}",v(r(1),2))}};var X=.2,he=8,U=class extends T{constructor(){super("lens");let e=t=>`${v(t,2)} m`;this.range("fNumber",{min:0,max:12,step:1,value:2,from:t=>4*2**(t/2),format:M}),this.focus=this.range("focusDistance",{min:-1,max:1.6,step:.02,value:-.5,from:Math.exp,format:e}),this.distance=this.range("pointDistance",{min:-1,max:1.6,step:.02,value:.3,from:Math.exp,format:e}),this.svg=document.createElementNS("http://www.w3.org/2000/svg","svg"),this.svg.setAttribute("viewBox","0 0 800 250"),this.svg.setAttribute("role","img"),this.box.insertBefore(this.svg,this.box.querySelector(".tiles")),this.canvas.addEventListener("pointerdown",t=>this.pick(t))}async load(){await super.load();let{width:e,height:t,png:i}=PLAY.scene,r=f("canvas",{width:e,height:t}).getContext("2d");r.drawImage(await F(i),0,0),this.green=r.getImageData(0,0,e,t).data}pick(e){let{width:t,height:i,vergence:r}=PLAY.scene,n=this.canvas.getBoundingClientRect(),s=Math.floor((e.clientX-n.left)/n.width*this.canvas.width)%t,o=Math.floor((e.clientY-n.top)/n.height*this.canvas.height)%i,c=this.green[4*(o*t+s)+1]/255*r;this.distance.set(Math.log(1/Math.max(c,.2)))}drawn(){let{fNumber:e,focusDistance:t,pointDistance:i}=this.state,r=PLAY.scene.focal_length,n=_(r,e,t,i),{near:s,far:o}=N(r,e,t,n),c=h=>Number.isFinite(h)?`${v(h,2)} m`:m("none");this.said.textContent=m("lens.said").replace("{sigma}",v(1e6*n,1)).replace("{near}",c(s)).replace("{far}",c(o)),this.diagram(s,o),super.drawn()}draw(){let{fNumber:e,focusDistance:t}=this.state,i=PLAY.scene.focal_length;this.show([0,1],[M(22),M(e)],{apertures:[i/22,i/e],focus:[1/t,1/t]})}diagram(e,t){let{fNumber:i,focusDistance:r,pointDistance:n}=this.state,s=560,o=700,c=115,h=y=>s-40-480*Math.log(y/X)/Math.log(he/X),l=20+70*Math.min(1,4/i),u=y=>s+140*(1+.24*(1/y-1/r)),d=(y,k,E)=>[-1,1].map(A=>{let S=u(y),$=780,D=c+A*l,ue=(c-D)/(S-s);return`<path d="M${h(y)} ${c}L${s} ${D}L${$} ${D+ue*($-s)}" fill="none" stroke="${k}" stroke-width="1.5" stroke-dasharray="${E}"/>`}).join(""),p=n>r,g=p?e:t,w=u(n),x=l*Math.abs((o-w)/(w-s)),b=(y,k,E,A)=>`<circle cx="${h(y)}" cy="${c}" r="5" fill="${E}"/>
      <text x="${Math.max(h(y),60)}" y="${A?30:205}" text-anchor="middle" style="fill:${E}">${k}</text>`;this.svg.innerHTML=`
      <path d="M0 ${c}H800" stroke="var(--line)"/>
      <path d="M${h(r)} 45V185" stroke="var(--soft)" stroke-dasharray="3 4"/>
      <text x="${h(r)}" y="243" text-anchor="middle" style="fill:var(--soft)">${m("inFocus")}</text>
      ${g>X&&g<he?d(g,"var(--blue)","5 4")+b(g,`${v(g,2)} m`,"var(--blue)",!1):""}
      ${d(n,"var(--orange)","")}${b(n,`${v(n,2)} m`,"var(--orange)",!0)}
      <path d="M${s} 10V${c-l}M${s} ${c+l}V220" stroke="var(--text)" stroke-width="5"/>
      <ellipse cx="${s}" cy="${c}" rx="8" ry="${l}" fill="#8cf4" stroke="var(--text)"/>
      <path d="M${o} 20V210" stroke="var(--text)" stroke-width="2"/>
      <path d="M${o} ${c-x}V${c+x}" stroke="var(--orange)" stroke-width="6"/>
      <text x="${o}" y="243" text-anchor="middle">${m("sensor")}</text>`,this.svg.setAttribute("aria-label",this.said.textContent)}};var pe=640,H=Float64Array.from({length:256},(a,e)=>e<11?e/255/12.92:((e/255+.055)/1.055)**2.4);function ce(a,e,t){let i=f("canvas",{width:e,height:t}).getContext("2d");i.drawImage(a,0,0,e,t);let{data:r}=i.getImageData(0,0,e,t),n=new Uint8Array(e*t);for(let s=0;s<n.length;s++){let o=.2126*H[r[4*s]]+.7152*H[r[4*s+1]]+.0722*H[r[4*s+2]];n[s]=Math.round(255*(o<.0031308?12.92*o:1.055*o**(1/2.4)-.055))}return n}var G=class extends T{constructor(){super("own"),this.images={},this.choice("mode",["depth","photographs"],"depth"),this.parts={depth:[],photographs:[]};for(let[t,i]of[["depth","picture"],["depth","depthMap"],["photographs","photograph1"],["photographs","photograph2"]])this.file(t,i);let e=t=>`${v(t,2)} m`;this.parts.depth.push(this.choice("white",["near","far"],"near"),this.number("near",.4,.1),this.number("far",10,.1),this.number("fieldDegrees",20,1),this.range("aperture",{min:0,max:20,step:.5,value:9,format:t=>`${v(t,1)} mm`}),this.range("ownFocus",{min:-1,max:2.3,step:.05,value:-.5,from:Math.exp,format:e})),this.parts.photographs.push(this.number("f1",22,.5),this.number("f2",5.6,.5),this.number("focus1",1,.05),this.number("focus2",1,.05))}file(e,t){let i=f("input",{type:"file",accept:"image/*",name:t});i.addEventListener("change",async()=>{let[n]=i.files;if(n)try{this.images[t]=await F(URL.createObjectURL(n)),this.take(e)}catch{this.said.textContent=m("unreadable").replace("{name}",n.name)}});let r=f("label",{},f("span",{word:t}),i);this.controls.append(r),this.parts[e].push({label:r})}take(e){let[t,i]=e==="depth"?[this.images.picture,this.images.depthMap]:[this.images.photograph1,this.images.photograph2];if(!t||!i)return;let r=Math.min(1,pe/Math.max(t.naturalWidth,t.naturalHeight)),n=4*Math.floor(t.naturalWidth*r/4),s=4*Math.floor(t.naturalHeight*r/4);this.given={mode:e,width:n,height:s,parts:[ce(t,n,s),ce(i,n,s)]},this.change()}draw(){let{mode:e,white:t,near:i,far:r,fieldDegrees:n,aperture:s,ownFocus:o,f1:c,f2:h,focus1:l,focus2:u}=this.state;for(let w of["depth","photographs"])for(let{label:x}of this.parts[w])x.hidden=w!==e;let d=this.given?.mode===e?this.given:null,p=e==="photographs"&&(c!==h?c<h:l>u);if(d){let w=e==="depth"?1/i:1,x=e==="depth"?Math.min(i/r,1):0,b=JSON.stringify([e,p,t,i,r]);if(this.loaded!==d||this.key!==b){let y=new Uint8Array(4*d.width*d.height),[k,E]=p?[d.parts[1],d.parts[0]]:d.parts;for(let A=0;A<k.length;A++){let S=t==="near"?E[A]/255:1-E[A]/255;y[4*A]=k[A],y[4*A+1]=e==="depth"?Math.round(255*(x+(1-x)*S)):E[A]}this.views.load(y,{width:d.width,height:d.height,vergence:w,pair:e==="photographs"}),Object.assign(this,{loaded:d,key:b})}}else if(this.loaded)return this.loaded=null,this.load();let g=e==="depth"?[m("blurred"),m("depth")]:[...[c,h].map((w,x)=>`${M(w)}, ${v([l,u][x],2)} m`)];if(p&&g.reverse(),e==="depth"){let w=d?2*Math.tan(n*Math.PI/360)/d.width:PLAY.scene.pixel_angle;this.show([1,6],g,{apertures:[0,s/1e3],focus:[1/o,1/o]},w)}else if(d)this.show([0,1,7],[...g,m("ratio")],{window:8});else{let w=PLAY.scene.focal_length,x=[1/l,1/u],b=[w/c,w/h];this.show([0,1,7],[...g,m("ratio")],p?{apertures:b.reverse(),focus:x.reverse(),window:8}:{apertures:b,focus:x,window:8})}this.said.textContent=e==="depth"?m(d?"own.here":"own.example"):m(c===h&&l===u?"own.equal":c!==h?"own.apertures":"own.foci")}};var le=({least:a,most:e,ratios:t},i)=>t?a*(e/a)**i:a+(e-a)*i;var O=["pinhole","f/22","f/11","f/5.6"],de=["nearest","farthest"],q=class extends T{constructor(){super("rating",{scene:!1}),this.place=f("div"),this.box.insertBefore(this.place,this.controls);let[e,t]=PLAY.rating.simulated.scale;this.slider=this.range("rating",{min:0,max:1,step:.0125,value:.5,from:i=>le({least:e,most:t,ratios:!0},i),format:i=>v(i,2)}),this.button=f("button",{type:"button",onclick:()=>this.next()}),this.controls.append(this.button),this.restart()}async load(){}drawn(){}restart(){this.answers={},this.order=de.flatMap(e=>O.map(t=>({fixation:e,aperture:t})));for(let e=this.order.length-1;e>0;e--){let t=Math.floor(Math.random()*(e+1));[this.order[e],this.order[t]]=[this.order[t],this.order[e]]}this.done=0,this.render()}next(){if(this.done===this.order.length)return this.restart();let{fixation:e,aperture:t}=this.order[this.done++];(this.answers[e]??={})[t]=this.state.rating,this.slider.set(.5),this.render()}translate(){super.translate(),this.render()}render(){let e=this.order[this.done],{standard:t,pictures:i,marks:r,simulated:n}=PLAY.rating;if(this.slider.label.hidden=!e,this.button.textContent=m(e?"next":"again"),this.said.textContent=e?m(`look.${e.fixation}`).replace("{n}",this.done+1).replace("{all}",this.order.length):m("rating.said").replace("{n}",n.observers),!e)return this.place.replaceChildren(this.curves());let s=e.aperture==="pinhole"?"pinhole":`${e.aperture.replace("/","")}-${e.fixation}`,o=f("span",{className:"ring"}),[c,h]=r[e.fixation];Object.assign(o.style,{left:`${100*c}%`,top:`${100*h}%`});let l=(u,d,...p)=>f("figure",{},f("div",{style:"position:relative"},f("img",{src:u,alt:m(d)}),...p),f("figcaption",{textContent:m(d)}));this.place.replaceChildren(f("div",{className:"rate"},l(t,"standard"),l(i[s],"picture",o)))}curves(){let e=o=>90+190*o,t=o=>150-55*Math.log2(Math.min(Math.max(o,.25),4)),{means:i}=PLAY.rating.simulated,r=(o,c,h,l)=>`<path d="M${o.map((u,d)=>`${e(d)} ${t(u)}`).join("L")}" fill="none" stroke="${c}" stroke-width="${h}" stroke-dasharray="${l}"/>`,n=[.25,.5,1,2,4].map(o=>`<path d="M80 ${t(o)}H700" stroke="var(--line)"/><text x="70" y="${t(o)+5}" text-anchor="end">${v(o,o<1?2:0)}</text>`);O.forEach((o,c)=>n.push(`<text x="${e(c)}" y="292" text-anchor="middle">${o==="pinhole"?m("pinhole"):M(Number(o.slice(2)))}</text>`)),de.forEach((o,c)=>{let h=c?"var(--orange)":"var(--blue)",l=O.map(p=>i[o][p]),u=this.answers[o];n.push(r(l.map(p=>p[0]),h,2,"3 5"),...l.map(([,p,g],w)=>`<path d="M${e(w)} ${t(p)}V${t(g)}" stroke="${h}"/>`));let d=O.map(p=>u[p]/u.pinhole);n.push(r(d,h,4,""),...d.map((p,g)=>`<circle cx="${e(g)}" cy="${t(p)}" r="6" fill="${h}"/>`)),n.push(`<text x="90" y="${28*c-14}" style="fill:${h}">${m(`key.${o}`)}</text>`)});let s=document.createElementNS("http://www.w3.org/2000/svg","svg");return s.setAttribute("viewBox","0 -36 720 336"),s.innerHTML=n.join(""),s}};var K=[new U,new I,new C,new q,new G];function Z(a=B){ne(a),document.documentElement.lang=B;for(let e of document.querySelectorAll("[data-word]"))e.innerHTML=m(e.dataset.word);document.title=m("title"),document.getElementById("language").textContent=B==="en"?"Deutsch":"English",document.getElementById("language").lang=B==="en"?"de":"en";for(let e of K)e.captioned=null,e.translate()}document.getElementById("language").onclick=()=>Z(B==="en"?"de":"en");Z();var ge=Promise.all(K.map(a=>a.load()));Object.assign(globalThis,{panels:K,ready:ge,translate:Z,imageOf:F,TwoViews:L,WORDS:W,blurRadius:_,distancesOfBlur:N,eyeFocus:z,oscillation:R});})();

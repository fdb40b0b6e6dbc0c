// One pixel of a focus series: the two neighbouring planes, mixed in linear radiance and encoded for the display.
uniform sampler2DArray planes;  // linear radiance, decoded by the texture unit from 8-bit sRGB or half floats
uniform float last;             // index of the last plane
uniform float gain;             // factor by which the planes' radiance is multiplied
#ifdef VARIES
uniform sampler2D places;       // fractional plane index at each pixel
uniform vec4 frame;             // position of `places`: left, top, width, height, as fractions of the picture
#else
uniform float place;            // fractional plane index: 1.25 is a quarter of the way from plane 1 to plane 2
#endif
#ifndef SRGB
uniform vec3 gamma;             // exponent of luminance over pixel value for each gun
#endif
#ifdef LAMP
uniform vec2 size;              // width and height of the picture in pixels
uniform vec4 lamp;              // disc of light: column and row of its centre, radius in pixels, radiance

// Fraction of this pixel covered by the disc, whose radius is reduced to keep the second moment despite the pixel area.
float covered() {
    float radius = sqrt(max(lamp.z * lamp.z - 1.0 / 3.0, 0.25));
    vec2 from = where * size - lamp.xy - 0.5;
    float inside = 0.0;
    for (int n = 0; n < 64; n++) {
        vec2 part = (vec2(float(n - 8 * (n / 8)), float(n / 8)) + 0.5) / 8.0 - 0.5;
        inside += step(length(from + part), radius) / 64.0;
    }
    return inside;
}
#endif

vec3 encoded(vec3 light) {
    vec3 seen = clamp(light, 0.0, 1.0);
#ifdef SRGB
    return mix(12.92 * seen, 1.055 * pow(seen, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, seen));
#else
    return pow(seen, 1.0 / gamma);
#endif
}

void main() {
#ifdef VARIES
    float at = clamp(TEXEL(places, (where - frame.xy) / frame.zw).r, 0.0, last);
#else
    float at = clamp(place, 0.0, last);
#endif
    float below = min(floor(at), max(last - 1.0, 0.0));
    vec3 far = LAYER(planes, vec3(where, below)).rgb;
    vec3 near = LAYER(planes, vec3(where, min(below + 1.0, last))).rgb;
    vec3 light = mix(far, near, at - below) / gain;
#ifdef LAMP
    if (lamp.w > 0.0) light += lamp.w * covered();
#endif
    SHOWN = vec4(encoded(light), 1.0);
}

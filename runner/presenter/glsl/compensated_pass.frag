// The absolute XYZ of both views to the device codes of one eye: what leaks from the other eye is taken off, the panel
// is evened out, and codes follow as in colour_pass.frag. The NumPy twins are
// devices.compensation.crosstalk_cancel.cancel_crosstalk and devices.compensation.gain_map.GainMap.
//
// In 64 bits up to the codes, as colour_pass.frag: what remains of a dark channel after the leak is taken off is again
// the small difference of larger terms. Where the signal is squeezed, XYZ is averaged before anything else: an eye's
// pixel leaks as the one pixel that the panel has of it.

uniform sampler2D own_XYZ;        // float32 or float16, cd/m², top row first
uniform sampler2D other_XYZ;      // of the other eye, the same size
uniform ivec2 box;                // pixels of the picture, across and down, that share one of the codes
uniform dmat3 own_linear_from_XYZ;
uniform dmat3 other_linear_from_XYZ;
uniform dvec3 own_black_XYZ;
uniform dvec3 other_black_XYZ;

uniform int cancels;              // 0: leaks stay, and nothing is clipped before the gain
uniform dvec3 lift_share;         // added to both eyes' light
uniform dmat3 other_from_own;     // what to send to the other eye is other_from_own · own + other_from_other · other
uniform dmat3 other_from_other;
uniform dmat3 leak;               // from the other eye's light to what it adds to this eye's

uniform int evens;                // 0: the gain is 1 everywhere
uniform sampler2D gains;          // top row first; each is the sum of two floats, to 48 bits
uniform sampler2D reading_steps;  // two texels: how many readings, across and down, lie before the top left code, and
                                  // how many between two codes; numbers are sums too, .xy + .zw
uniform dvec3 delivered_share;
uniform dvec3 black_light;        // own_linear_from_XYZ · own_black_XYZ

out vec4 codes;

vec4 codes_of_linear(dvec3 asked);
dvec3 own_within(dvec3 light);
dvec3 other_within(dvec3 light);

dvec3 mean_XYZ(sampler2D picture, ivec2 first, ivec2 end) {
    dvec3 XYZ = dvec3(0.0);
    for (int y = first.y; y < end.y; y++) {
        for (int x = first.x; x < end.x; x++) {
            XYZ += dvec3(texelFetch(picture, ivec2(x, y), 0).rgb);
        }
    }
    return XYZ / double((end.x - first.x) * (end.y - first.y));
}

double reading(ivec2 place) {
    vec2 parts = texelFetch(gains, place, 0).rg;
    return double(parts.x) + double(parts.y);
}

dvec2 steps_of(int texel) {
    vec4 parts = texelFetch(reading_steps, ivec2(texel, 0), 0);
    return dvec2(parts.xy) + dvec2(parts.zw);
}

double gain_at(ivec2 place) {
    ivec2 last = textureSize(gains, 0) - 1;
    dvec2 steps = clamp(steps_of(0) + steps_of(1) * dvec2(place), dvec2(0.0), dvec2(last));
    ivec2 before = min(ivec2(steps), max(last - 1, 0));
    ivec2 after = min(before + 1, last);
    dvec2 on = steps - dvec2(before);
    double upper = (1.0 - on.x) * reading(before) + on.x * reading(ivec2(after.x, before.y));
    double lower = (1.0 - on.x) * reading(ivec2(before.x, after.y)) + on.x * reading(after);
    return (1.0 - on.y) * upper + on.y * lower;
}

void main() {
    ivec2 size = textureSize(own_XYZ, 0);
    ivec2 place = ivec2(gl_FragCoord.xy);  // y upwards
    place.y = (size.y + box.y - 1) / box.y - 1 - place.y;
    ivec2 first = place * box;
    ivec2 end = min(first + box, size);
    dvec3 light = own_linear_from_XYZ * (mean_XYZ(own_XYZ, first, end) - own_black_XYZ);
    if (cancels != 0) {
        dvec3 other = other_linear_from_XYZ * (mean_XYZ(other_XYZ, first, end) - other_black_XYZ);
        dvec3 wanted = own_within(own_within(light) + lift_share);
        dvec3 wanted_other = other_within(other_within(other) + lift_share);
        dvec3 sent_other = other_within(other_from_own * wanted + other_from_other * wanted_other);
        light = own_within(wanted - leak * sent_other);
    }
    if (evens != 0) {
        // The panel dims black too: gain · (black + light) is what is seen.
        light = delivered_share / gain_at(place) * (light + black_light) - black_light;
    }
    codes = codes_of_linear(light);
}

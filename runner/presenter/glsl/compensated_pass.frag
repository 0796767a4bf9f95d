// The absolute XYZ of both views to the device codes of one eye: what leaks from the other eye is taken off, the panel
// is evened out, and codes follow as in colour_pass.frag. The NumPy twins are
// devices.compensation.crosstalk_cancel.cancel_crosstalk and devices.compensation.gain_map.GainMap.
//
// In Reals up to the codes, as colour_pass.frag: what remains of a dark channel after the leak is taken off is again
// the small difference of larger terms. Where the signal is squeezed, XYZ is averaged before anything else: an eye's
// pixel leaks as the one pixel that the panel has of it.

uniform sampler2D own_XYZ;        // float32 or float16, cd/m², top row first
uniform sampler2D other_XYZ;      // of the other eye, the same size
uniform ivec2 box;                // pixels of the picture, across and down, that share one of the codes
uniform Real3x3 own_linear_from_XYZ;
uniform Real3x3 other_linear_from_XYZ;
uniform Real3 dark_light;         // own_linear_from_XYZ · (the black of this eye and the room's light)
uniform Real3 other_dark_light;

uniform int cancels;              // 1, or 0: leaks stay, and nothing is clipped before the gain
uniform Real3 lift_share;         // added to both eyes' light
uniform Real3x3 other_from_own;   // what to send to the other eye is other_from_own · own + other_from_other · other
uniform Real3x3 other_from_other;
uniform Real3x3 leak;             // from the other eye's light to what it adds to this eye's

uniform int evens;                // 0: the gain is 1 everywhere
uniform sampler2D gains;          // top row first; each is the sum of two floats, to 48 bits
uniform sampler2D reading_steps;  // two texels: how many readings, across and down, lie before the top left code, and
                                  // how many between two codes; numbers are sums too, .xy + .zw
uniform Real delivered_share;
uniform Real3 black_light;        // own_linear_from_XYZ · the black of this eye

out vec4 codes;

vec4 codes_of_channels(Real3 T);
Real3 channels_of(int eye, Real3 light);
Real3 channels_within(int eye, Real3 light);
Real3 light_of(int eye, Real3 T);

Real reading(ivec2 place) {
    vec2 parts = texelFetch(gains, place, 0).rg;
    return real(parts.x, parts.y);
}

// How many readings lie before the code in `place`, and how far it is from there to the next.
void between_readings(int place, int last, vec4 start, vec4 step, int axis, out int before, out Real on) {
    Real steps = add(real(start[axis], start[axis + 2]), mul(real(step[axis], step[axis + 2]), float(place)));
    steps = limit(steps, 0.0, float(last));
    // The float may have been rounded up to the next.
    before = min(int(float_of(steps)), max(last - 1, 0));
    before -= at_most(real(float(before)), steps) ? 0 : 1;
    on = sub(steps, float(before));
}

Real between(Real first, Real second, Real on) {
    return add(first, mul(on, sub(second, first)));
}

Real gain_at(ivec2 place) {
    ivec2 last = textureSize(gains, 0) - 1;
    vec4 start = texelFetch(reading_steps, ivec2(0), 0);
    vec4 step = texelFetch(reading_steps, ivec2(1, 0), 0);
    ivec2 before;
    Real across, down;
    between_readings(place.x, last.x, start, step, 0, before.x, across);
    between_readings(place.y, last.y, start, step, 1, before.y, down);
    ivec2 after = min(before + 1, last);
    Real upper = between(reading(before), reading(ivec2(after.x, before.y)), across);
    Real lower = between(reading(ivec2(before.x, after.y)), reading(after), across);
    return between(upper, lower, down);
}

// Both eyes' light, clipped, lifted, clipped again, becomes what is sent to the other eye, and then to this one, whose
// channels give T of it. Where nothing follows, codes are those of T: a channel that gives none then has none, and not
// what the way there and back rounds it to, which is a part of a code where a curve is flat.
#if defined(LONG_WITHIN) && defined(TWO_FLOATS)
// In a loop that channels_within stands in once: Newton's method in two floats takes drivers half a minute to compile six
// times. In doubles that takes seconds, and the loop would draw in almost twice the time.
void cancel(inout Real3 own, inout Real3 other, out Real3 T) {
    for (int step = 0; step < 6 * cancels; step++) {
        int eye = step < 4 ? step & 1 : 5 - step;
        Real3 asked = own;
        if (step == 4) {
            asked = add(mul(other_from_own, own), mul(other_from_other, other));
        } else if (step == 5) {
            asked = sub(own, mul(leak, other));
        } else {
            if (eye == 1) {
                asked = other;
            }
            if (step >= 2) {
                asked = add(asked, lift_share);
            }
        }
        T = channels_within(eye, asked);
        Real3 light = light_of(eye, T);
        if (eye == 0) {
            own = light;
        } else {
            other = light;
        }
    }
}
#else
Real3 within(int eye, Real3 light) {
    return light_of(eye, channels_within(eye, light));
}

void cancel(inout Real3 own, inout Real3 other, out Real3 T) {
    own = within(0, add(within(0, own), lift_share));
    other = within(1, add(within(1, other), lift_share));
    other = within(1, add(mul(other_from_own, own), mul(other_from_other, other)));
    T = channels_within(0, sub(own, mul(leak, other)));
    own = light_of(0, T);
}
#endif

void main() {
    ivec2 size = textureSize(own_XYZ, 0);
    ivec2 place = ivec2(gl_FragCoord.xy);  // y upwards
    place.y = (size.y + box.y - 1) / box.y - 1 - place.y;
    ivec2 first = place * box;
    Real3 light = sub(mul(own_linear_from_XYZ, mean_XYZ(own_XYZ, first, box)), dark_light);
    Real3 T = light;
    if (cancels != 0) {
        Real3 other = sub(mul(other_linear_from_XYZ, mean_XYZ(other_XYZ, first, box)), other_dark_light);
        cancel(light, other, T);
    }
    if (evens != 0) {
        // The panel dims black too, and not the room's light: room + gain · (black + light) is what is seen.
        light = sub(mul(add(light, black_light), div(delivered_share, gain_at(place))), black_light);
    }
    if (cancels == 0 || evens != 0) {
        T = channels_of(0, light);
    }
    codes = codes_of_channels(T);
}

// Light in units of the primaries to the linear light of channels that do not add up: Newton's method, for each pixel.
// What is missed is computed in Reals, and decides; the slopes only lead there, and are floats. The NumPy twin is
// devices.display.plvc.Plvc.newton. What follows calls it in place of encode.glsl or dither.glsl, which it calls in
// turn.

uniform Real3 plvc_powers[30];    // by eye (own, other), channel and power of the root of light, 0 to 4
uniform Real3 plvc_mixtures[20];  // by eye: red and green, red and blue, green and blue, all, then middle levels
uniform ivec2 plvc_steps;         // at most, by eye

// What the model adds to all this: plvc_residual.glsl, or plvc_alone.glsl where it adds nothing.
Real3 add_residual(int eye, Real3 T, Real3 light, inout mat3 slopes);

// A step this long is the last: what remains is its square, or 1e-6 of it, which is what the slopes err by; at the
// border of the gamut, where they jump, a tenth of it, which a curve that is flat there still shows.
const float LAST_STEP = 1e-13;
// Less than this is what no light was rounded to, and a part of a code where a curve is flat.
const float NO_LIGHT = 5.7e-14;

Real3 add_pair(Real3 light, inout vec3 by_one, inout vec3 by_other, Real one, Real other, Real3 both, Real3 while_other,
               Real3 while_one) {
    Real3 from_other = mul(while_other, sub(real(1.0), one));
    Real3 from_one = mul(while_one, sub(real(1.0), other));
    Real3 shared_light = add(both, add(from_other, from_one));
    float one_float = float_of(one);
    float other_float = float_of(other);
    by_one += other_float * (floats_of(shared_light) - one_float * floats_of(while_other));
    by_other += one_float * (floats_of(shared_light) - other_float * floats_of(while_one));
    return add(light, mul(shared_light, mul(one, other)));
}

Real3 light_and_slopes(int eye, Real3 T, out mat3 slopes) {
    Real3 roots = root(T);
    Real3 light = real3(vec3(0.0));
    for (int channel = 0; channel < 3; channel++) {
        int last = 15 * eye + 5 * channel + 4;
        Real root_of_light = channel_of(roots, channel);
        float root_float = float_of(root_of_light);
        Real3 per_light = plvc_powers[last];
        vec3 slope = 3.0 * floats_of(per_light);
        for (int power = 3; power >= 0; power--) {
            Real3 next = plvc_powers[last - 4 + power];
            per_light = add(mul(per_light, root_of_light), next);
            slope = slope * root_float + (1.0 + 0.5 * float(power)) * floats_of(next);
        }
        light = add(light, mul(per_light, channel_of(T, channel)));
        slopes[channel] = slope;
    }
    int at = 10 * eye;
    Real r = channel_of(T, 0);
    Real g = channel_of(T, 1);
    Real b = channel_of(T, 2);
    light = add_pair(light, slopes[0], slopes[1], r, g, plvc_mixtures[at], plvc_mixtures[at + 4], plvc_mixtures[at + 6]);
    light = add_pair(light, slopes[0], slopes[2], r, b, plvc_mixtures[at + 1], plvc_mixtures[at + 5], plvc_mixtures[at + 8]);
    light = add_pair(light, slopes[1], slopes[2], g, b, plvc_mixtures[at + 2], plvc_mixtures[at + 7], plvc_mixtures[at + 9]);
    Real3 all = plvc_mixtures[at + 3];
    vec3 all_floats = floats_of(all);
    vec3 T_floats = floats_of(T);
    slopes[0] += T_floats.g * T_floats.b * all_floats;
    slopes[1] += T_floats.r * T_floats.b * all_floats;
    slopes[2] += T_floats.r * T_floats.g * all_floats;
    return add_residual(eye, T, add(light, mul(all, mul(mul(r, g), b))), slopes);
}

Real3 light_of(int eye, Real3 T) {
    mat3 slopes;
    return light_and_slopes(eye, T, slopes);
}

Real3 channels_of(int eye, Real3 asked) {
    asked = limit(asked, -1e6, 1e6);
    Real3 T = asked;
    for (int i = 0; i < plvc_steps[eye]; i++) {
        // Beyond its ends a channel goes on along its primary.
        Real3 inside = limit(T, 0.0, 1.0);
        Real3 beyond = sub(T, inside);
        mat3 slopes;
        Real3 light = light_and_slopes(eye, inside, slopes);
        vec3 miss = floats_of(sub(add(light, beyond), asked));
        vec3 outside = floats_of(beyond);
        if (outside.r != 0.0) slopes[0] = vec3(1.0, 0.0, 0.0);
        if (outside.g != 0.0) slopes[1] = vec3(0.0, 1.0, 0.0);
        if (outside.b != 0.0) slopes[2] = vec3(0.0, 0.0, 1.0);
        vec3 first = cross(slopes[1], slopes[2]);
        vec3 off = vec3(dot(miss, first), dot(miss, cross(slopes[2], slopes[0])), dot(miss, cross(slopes[0], slopes[1])));
        vec3 step = off / dot(slopes[0], first);
        // What went round in circles until then finds its way by halves.
        T = sub(T, (i >= 8 && i < 16 ? 0.5 : 1.0) * step);
        if (all(lessThan(abs(step), vec3(LAST_STEP)))) break;
    }
    vec3 T_floats = floats_of(T);
    return mul(T, vec3(greaterThanEqual(abs(T_floats), vec3(NO_LIGHT))));
}

vec4 codes_of_channels(Real3 T) {
    return codes_of_linear(T);
}

vec4 codes_of_light(Real3 asked) {
    return codes_of_linear(channels_of(0, asked));
}

#define codes_of_linear codes_of_light

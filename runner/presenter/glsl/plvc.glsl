// Light in units of the primaries to the linear light of channels that do not add up: Newton's method, in 64 bits, for
// each pixel. The NumPy twin is devices.display.plvc.Plvc.newton. What follows calls it in place of encode.glsl or
// dither.glsl, which it calls in turn.

uniform dvec3 plvc_powers[30];    // by eye (own, other), channel and power of the root of light, 0 to 4
uniform dvec3 plvc_mixtures[20];  // by eye: red and green, red and blue, green and blue, all, then middle levels
uniform ivec2 plvc_steps;         // at most, by eye

void add_pair(inout dvec3 light, inout dvec3 by_one, inout dvec3 by_other, double one, double other, dvec3 both,
              dvec3 while_other, dvec3 while_one) {
    dvec3 shared = both + while_other * (1.0 - one) + while_one * (1.0 - other);
    light += one * other * shared;
    by_one += other * (shared - one * while_other);
    by_other += one * (shared - other * while_one);
}

void light_and_slopes(int eye, dvec3 T, out dvec3 light, out dmat3 slopes) {
    dvec3 root = sqrt(T);
    light = dvec3(0.0);
    for (int channel = 0; channel < 3; channel++) {
        int last = 15 * eye + 5 * channel + 4;
        dvec3 per_light = plvc_powers[last];
        dvec3 slope = 3.0 * per_light;
        for (int power = 3; power >= 0; power--) {
            dvec3 next = plvc_powers[last - 4 + power];
            per_light = per_light * root[channel] + next;
            slope = slope * root[channel] + (1.0 + 0.5 * double(power)) * next;
        }
        light += T[channel] * per_light;
        slopes[channel] = slope;
    }
    int at = 10 * eye;
    dvec3 all = plvc_mixtures[at + 3];
    add_pair(light, slopes[0], slopes[1], T.r, T.g, plvc_mixtures[at], plvc_mixtures[at + 4], plvc_mixtures[at + 6]);
    add_pair(light, slopes[0], slopes[2], T.r, T.b, plvc_mixtures[at + 1], plvc_mixtures[at + 5], plvc_mixtures[at + 8]);
    add_pair(light, slopes[1], slopes[2], T.g, T.b, plvc_mixtures[at + 2], plvc_mixtures[at + 7], plvc_mixtures[at + 9]);
    light += T.r * T.g * T.b * all;
    slopes[0] += T.g * T.b * all;
    slopes[1] += T.r * T.b * all;
    slopes[2] += T.r * T.g * all;
}

dvec3 light_of(int eye, dvec3 T) {
    dvec3 light;
    dmat3 slopes;
    light_and_slopes(eye, T, light, slopes);
    return light;
}

dvec3 channels_of(int eye, dvec3 asked) {
    asked = clamp(asked, dvec3(-1e6), dvec3(1e6));
    dvec3 T = asked;
    for (int i = 0; i < plvc_steps[eye]; i++) {
        // Beyond its ends a channel goes on along its primary.
        dvec3 inside = clamp(T, dvec3(0.0), dvec3(1.0));
        dvec3 light;
        dmat3 slopes;
        light_and_slopes(eye, inside, light, slopes);
        dvec3 miss = light + (T - inside) - asked;
        if (T.r != inside.r) slopes[0] = dvec3(1.0, 0.0, 0.0);
        if (T.g != inside.g) slopes[1] = dvec3(0.0, 1.0, 0.0);
        if (T.b != inside.b) slopes[2] = dvec3(0.0, 0.0, 1.0);
        dvec3 first = cross(slopes[1], slopes[2]);
        dvec3 off = dvec3(dot(miss, first), dot(miss, cross(slopes[2], slopes[0])), dot(miss, cross(slopes[0], slopes[1])));
        dvec3 step = off / dot(slopes[0], first);
        // What went round in circles until then finds its way by halves.
        T -= (i >= 8 && i < 16 ? 0.5LF : 1.0LF) * step;
        if (all(lessThan(abs(step), dvec3(2e-14)))) break;
    }
    return T;
}

vec4 codes_of_light(dvec3 asked) {
    return codes_of_linear(channels_of(0, asked));
}

#define codes_of_linear codes_of_light

// What the channels of an eye's display model can give of light, in place of within.glsl where they do not add up: each
// channel's own light.

Real3 channels_within(int eye, Real3 light) {
    return limit(channels_of(eye, light), 0.0, 1.0);
}

#define LONG_WITHIN

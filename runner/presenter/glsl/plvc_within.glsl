// Light clipped to what the channels of an eye's display model can give, in place of within.glsl where they do not add
// up: by way of each channel's own light.

Real3 within(int eye, Real3 light) {
    return light_of(eye, limit(channels_of(eye, light), 0.0, 1.0));
}

#define LONG_WITHIN

// What the channels of an eye's display model can give of light: 0 to 1, as models are normalised. Eye 0 is this pass's
// own, 1 the other. Channels that add up give their light.

Real3 channels_within(int eye, Real3 light) {
    return limit(light, 0.0, 1.0);
}

Real3 channels_of(int eye, Real3 light) {
    return light;
}

Real3 light_of(int eye, Real3 T) {
    return T;
}

vec4 codes_of_channels(Real3 T) {
    return codes_of_linear(T);
}

// Light clipped to what the channels of an eye's display model can give, in place of within.glsl where they do not add
// up: by way of each channel's own light.

uniform Real3 own_limits[2];      // the least and the most light of each channel
uniform Real3 other_limits[2];

Real3 own_within(Real3 light) {
    return light_of(0, limit(channels_of(0, light), own_limits[0], own_limits[1]));
}

Real3 other_within(Real3 light) {
    return light_of(1, limit(channels_of(1, light), other_limits[0], other_limits[1]));
}

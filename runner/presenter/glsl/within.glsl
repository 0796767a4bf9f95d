// Light clipped to what the channels of an eye's display model can give.

uniform Real3 own_limits[2];      // the least and the most light of each channel
uniform Real3 other_limits[2];

Real3 own_within(Real3 light) {
    return limit(light, own_limits[0], own_limits[1]);
}

Real3 other_within(Real3 light) {
    return limit(light, other_limits[0], other_limits[1]);
}

// Light clipped to what the channels of an eye's display model can give.

uniform dmat2x3 own_limits;       // the least and the most light of each channel
uniform dmat2x3 other_limits;

dvec3 own_within(dvec3 light) {
    return clamp(light, own_limits[0], own_limits[1]);
}

dvec3 other_within(dvec3 light) {
    return clamp(light, other_limits[0], other_limits[1]);
}

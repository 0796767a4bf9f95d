// Every channel by knots.glsl.

float code_of_light(int channel, Real light) {
    return code_by_knots(channel, light);
}

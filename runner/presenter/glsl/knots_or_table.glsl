// Each channel by the one of knots.glsl and table_fourth_root.glsl that its curve has: two eyes' channels in one
// picture.

uniform ivec3 by_knots;

float code_of_light(int channel, Real light) {
    return by_knots[channel] != 0 ? code_by_knots(channel, light) : code_by_table(channel, light);
}

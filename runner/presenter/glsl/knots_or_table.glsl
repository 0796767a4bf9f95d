// Each channel by the one of knots.glsl and table_fourth_root.glsl that its curve has: two eyes' channels in one
// picture.

uniform ivec3 by_knots;

float code_of_either(int channel, double light) {
    return by_knots[channel] != 0 ? code_of_light(channel, light) : code_of_light(channel, float(light));
}

#define code_of_light code_of_either

// Every channel by table_fourth_root.glsl.

float code_of_light(int channel, Real light) {
    return code_by_table(channel, light);
}

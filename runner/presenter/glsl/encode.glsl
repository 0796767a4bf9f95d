// Each channel's linear light to its code, rounded to levels.

uniform dvec3 lift;
uniform dvec3 scale;              // 1 / (1 - lift)
uniform float levels;             // 255 rounds to codes of 8 bits; 0 leaves them as they are

float code_of_light(int channel, Light light);

vec4 codes_of_linear(dvec3 asked) {
    dvec3 linear = clamp(asked, dvec3(0.0), dvec3(1.0));
    Lights light = Lights(max((linear - lift) * scale, dvec3(0.0)));
    vec3 code = vec3(code_of_light(0, light.r), code_of_light(1, light.g), code_of_light(2, light.b));
    code = clamp(code, 0.0, 1.0);
    return vec4(levels > 0.0 ? floor(code * levels + 0.5) / levels : code, 1.0);
}

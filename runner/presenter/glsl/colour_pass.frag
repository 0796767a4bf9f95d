// Absolute XYZ to device codes: linear = M⁻¹ (XYZ - black), clip, the inverse of each channel's tone curve.
// The NumPy twin is devices.code_table.table_codes. Where the signal is squeezed, the XYZ of a box of pixels is averaged
// first: light adds up, codes do not.
//
// The matrix is applied in 64 bits. A saturated colour leaves one channel with the small difference of large
// terms; in 32 bits that difference is wrong by 1e-7 of full light, and 1e-7 is a whole code at gamma 2.9.

uniform sampler2D picture_XYZ;    // float32 or float16, cd/m², top row first
uniform dmat3 linear_from_XYZ;
uniform dvec3 black_XYZ;
uniform dvec3 lift;
uniform dvec3 scale;              // 1 / (1 - lift)
uniform ivec2 box;                // pixels of the picture, across and down, that share one of the codes
uniform float levels;             // 255 rounds to codes of 8 bits; 0 leaves them as they are

out vec4 codes;

float code_of_light(int channel, float light);

void main() {
    ivec2 size = textureSize(picture_XYZ, 0);
    ivec2 place = ivec2(gl_FragCoord.xy);  // y upwards
    place.y = (size.y + box.y - 1) / box.y - 1 - place.y;
    ivec2 first = place * box;
    ivec2 end = min(first + box, size);
    dvec3 XYZ = dvec3(0.0);
    for (int y = first.y; y < end.y; y++) {
        for (int x = first.x; x < end.x; x++) {
            XYZ += dvec3(texelFetch(picture_XYZ, ivec2(x, y), 0).rgb);
        }
    }
    XYZ /= double((end.x - first.x) * (end.y - first.y));
    dvec3 linear = clamp(linear_from_XYZ * (XYZ - black_XYZ), dvec3(0.0), dvec3(1.0));
    vec3 light = vec3(max((linear - lift) * scale, dvec3(0.0)));
    vec3 code = vec3(code_of_light(0, light.r), code_of_light(1, light.g), code_of_light(2, light.b));
    code = clamp(code, 0.0, 1.0);
    codes = vec4(levels > 0.0 ? floor(code * levels + 0.5) / levels : code, 1.0);
}

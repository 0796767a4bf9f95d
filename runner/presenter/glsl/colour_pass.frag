// Absolute XYZ to device codes: linear = M⁻¹ XYZ - M⁻¹ black, clip, the inverse of each channel's tone curve. The NumPy
// twin is devices.display.code_table.table_codes. Where the signal is squeezed, the XYZ of a box of pixels is averaged
// first: light adds up, codes do not.
//
// The matrix is applied to Reals (arithmetic_double.glsl). A saturated colour leaves one channel with the small
// difference of large terms; in 32 bits that difference is wrong by 1e-7 of full light, and 1e-7 is a whole code at
// gamma 2.9.

uniform sampler2D picture_XYZ;    // float32 or float16, cd/m², top row first
uniform Real3x3 linear_from_XYZ;
uniform Real3 black_light;        // linear_from_XYZ · black
uniform ivec2 box;                // pixels of the picture, across and down, that share one of the codes

out vec4 codes;

vec4 codes_of_linear(Real3 asked);

void main() {
    ivec2 size = textureSize(picture_XYZ, 0);
    ivec2 place = ivec2(gl_FragCoord.xy);  // y upwards
    place.y = (size.y + box.y - 1) / box.y - 1 - place.y;
    codes = codes_of_linear(sub(mul(linear_from_XYZ, mean_XYZ(picture_XYZ, place * box, box)), black_light));
}

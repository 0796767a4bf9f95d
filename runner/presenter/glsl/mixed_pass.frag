// The absolute XYZ of both views to the codes of one picture: linear = left · (XYZ - black) + right · (XYZ - black).
// In 64 bits, as colour_pass.frag. The NumPy twin is devices.compensation.mixture.Mixture.code.

uniform sampler2D left_XYZ;       // float32 or float16, cd/m², top row first
uniform sampler2D right_XYZ;
uniform dmat3 linear_from_left;
uniform dmat3 linear_from_right;
uniform dvec3 left_black;
uniform dvec3 right_black;

out vec4 codes;

vec4 codes_of_linear(dvec3 asked);

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy);  // y upwards
    place.y = textureSize(left_XYZ, 0).y - 1 - place.y;
    dvec3 left = dvec3(texelFetch(left_XYZ, place, 0).rgb) - left_black;
    dvec3 right = dvec3(texelFetch(right_XYZ, place, 0).rgb) - right_black;
    codes = codes_of_linear(linear_from_left * left + linear_from_right * right);
}

// The absolute XYZ of both views to the codes of one picture: linear = left · (XYZ - black) + right · (XYZ - black).
// In Reals, as colour_pass.frag. The NumPy twin is devices.compensation.mixture.Mixture.code.

uniform sampler2D left_XYZ;       // float32 or float16, cd/m², top row first
uniform sampler2D right_XYZ;
uniform Real3x3 linear_from_left;
uniform Real3x3 linear_from_right;
uniform Real3 black_light;        // of both blacks

out vec4 codes;

vec4 codes_of_linear(Real3 asked);

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy);  // y upwards
    place.y = textureSize(left_XYZ, 0).y - 1 - place.y;
    Real3 left = mul(linear_from_left, real3(texelFetch(left_XYZ, place, 0).rgb));
    Real3 right = mul(linear_from_right, real3(texelFetch(right_XYZ, place, 0).rgb));
    codes = codes_of_linear(sub(add(left, right), black_light));
}

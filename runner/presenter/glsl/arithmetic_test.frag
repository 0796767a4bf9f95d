// Each operation of arithmetic_two_float.glsl on known numbers: a column for each, two rows for each operation, the
// upper float and the lower. runner.presenter.arithmetic_choice compares them with NumPy's.

uniform sampler2D numbers;        // rows: a's upper float, a's lower, b's upper, b's lower
uniform Real3x3 matrix;

out vec4 found;

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy);
    vec3 a_high = texelFetch(numbers, ivec2(place.x, 0), 0).rgb;
    vec3 b_high = texelFetch(numbers, ivec2(place.x, 2), 0).rgb;
    Real3 a = real3(a_high, texelFetch(numbers, ivec2(place.x, 1), 0).rgb);
    Real3 b = real3(b_high, texelFetch(numbers, ivec2(place.x, 3), 0).rgb);
    Real3 result;
    switch (place.y / 2) {
    case 0:
        result = add(a, b);
        break;
    case 1:
        result = sub(a, b);
        break;
    case 2:
        result = mul(a, b);
        break;
    case 3:
        result = div(a, channel_of(b, 0));
        break;
    case 4:
        result = root(mul(a, sign(a_high)));
        break;
    case 5:
        result = mul(a, b_high);
        break;
    default:
        result = mul(matrix, real3(vec3(a_high.r)));
        break;
    }
    vec3 high = floats_of(result);
    found = vec4((place.y & 1) == 0 ? high : floats_of(sub(result, high)), 1.0);
}

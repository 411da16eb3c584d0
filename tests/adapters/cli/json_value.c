/* json_value -- print one value of a JSON file, for shell scripts.
 *
 *   ./json_value FILE KEY...
 *
 * The keys lead inwards; a number is a place in an array; without keys the value is the whole file. Objects print their keys,
 * one a line and sorted, arrays their length. The exit status is 1 if there is no such value. */
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv)
{
  json_error_t  error;
  json_t       *whole = argc > 1 ? json_load_file(argv[1], 0, &error) : NULL;
  const json_t *value = whole;
  const char   *key;
  json_t       *inner;

  if (!whole) {
    fprintf(stderr, "json_value: %s\n", argc > 1 ? error.text : "give a file");
    return 1;
  }
  for (int i = 2; value && i < argc; i++)
    value = json_is_array(value) ? json_array_get(value, (size_t)strtol(argv[i], NULL, 10)) : json_object_get(value, argv[i]);
  if (json_is_object(value))
    json_object_foreach((json_t *)value, key, inner) printf("%s\n", key);
  else if (json_is_array(value))
    printf("%zu\n", json_array_size(value));
  else if (json_is_string(value))
    printf("%s\n", json_string_value(value));
  else if (json_is_integer(value))
    printf("%lld\n", (long long)json_integer_value(value));
  else if (json_is_real(value))
    printf("%.17g\n", json_real_value(value));
  else if (value)
    printf("%s\n", json_is_true(value) ? "true" : json_is_false(value) ? "false" : "null");
  json_decref(whole);
  return value ? 0 : 1;
}

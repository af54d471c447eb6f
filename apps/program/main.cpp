#include <taut/apps/program/command_line.hpp>

int main(int argc, char** argv) { return taut::run_program(argc, argv); }

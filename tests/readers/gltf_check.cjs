// Runs Khronos' validator on .glb files: node gltf_check.cjs FOLDER_OF_MODULES FILE... One line of JSON for each file.
const fs = require("fs");
const { createRequire } = require("module");
const [modules, ...files] = process.argv.slice(2);
const validator = createRequire(`${fs.realpathSync(modules)}/`)("gltf-validator");

async function main() {
  for (const file of files) {
    const { issues } = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)));
    const { numErrors: errors, numWarnings: warnings, messages } = issues;
    console.log(JSON.stringify({ errors, warnings, messages }));
  }
}
main();
